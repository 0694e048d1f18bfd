#include "host/files/write_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "calibration/record/strict_json.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/part_file.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// A path by which the same file is always named: links are followed in its folder, not in its own name.
fs::path place_of(const fs::path& path) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(path, ignored).parent_path(), ignored) / path.filename();
}

bool is_in(const fs::path& place, const char* folder) {
  const fs::path way = place.lexically_relative(folder);
  return !way.empty() && *way.begin() != "." && *way.begin() != "..";
}

/// The link in /dev or /proc that a path names, maybe through further links, as /dev/stdout does; empty: it names none.
fs::path system_link_of(fs::path path) {
  constexpr int kMostLinks = 40;  // more than the kernel follows
  std::error_code error;
  fs::path found;
  for (int n = 0; n < kMostLinks && fs::is_symlink(path, error); ++n) {
    path = place_of(path);
    if (is_in(path, "/proc") || is_in(path, "/dev")) found = path;
    const fs::path to = fs::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / to;
  }
  return found;
}

/// What a path has open that names a descriptor of this program, as /dev/stdout does: so that what is written goes on
/// where this program's own lines end.
UniqueFd own_descriptor(const fs::path& path) {
  const fs::path link = system_link_of(path);
  if (link.parent_path() != place_of("/proc/self/fd/0").parent_path()) return UniqueFd();
  int number = -1;
  const std::string name = link.filename().string();
  if (std::from_chars(name.data(), name.data() + name.size(), number).ec != std::errc()) return UniqueFd();
  return UniqueFd(::fcntl(number, F_DUPFD_CLOEXEC, 0));
}

Error cannot_be_written(const fs::path& named) {
  return {Errc::unreadable,
          fmt::format("{}: cannot be written; check the folder, its permissions, and whether the disk is full",
                      named.string())};
}

Result<void> put(const UniqueFd& fd, const FileText& file) {
  if (!fd) return cannot_be_written(file.path);
  for (std::size_t at = 0; at < file.text.size();) {
    const ssize_t wrote = ::write(fd.get(), file.text.data() + at, file.text.size() - at);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return cannot_be_written(file.path);
    at += static_cast<std::size_t>(wrote);
  }
  return {};
}

/// Into a device or a pipe that is there. It is not waited for: one that nobody reads is refused.
Result<void> put_as_it_is(const FileText& file) {
  if (const UniqueFd own = own_descriptor(file.path)) return put(own, file);
  const UniqueFd fd(::open(file.path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!fd && errno == ENXIO)
    return Error{Errc::unreadable,
                 fmt::format("{}: nobody reads this pipe; start its reader first", file.path.string())};
  if (fd && ::fcntl(fd.get(), F_SETFL, O_APPEND) != 0) return cannot_be_written(file.path);
  return put(fd, file);
}

/// Beside the file, in a file of its own by a name that nobody has: what lies there is left alone. It gets the mode of
/// the file that it replaces. part: gets its path.
Result<void> put_part(const FileText& file, fs::path& part) {
  struct stat former {};
  const bool replaces = ::stat(file.path.c_str(), &former) == 0;
  if (!replaces && errno == ENAMETOOLONG)
    return Error{Errc::unreadable, fmt::format("{}: is too long a name; give a shorter one", file.path.string())};
  const mode_t mode = replaces ? former.st_mode & 0777U : 0666U;
  UniqueFd fd;
  part = take_part_name(file.path, [&](const fs::path& name) {
    fd = UniqueFd(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
    return static_cast<bool>(fd);
  });
  if (fd && replaces && ::fchmod(fd.get(), mode) != 0) return cannot_be_written(file.path);
  return put(fd, file);
}

}  // namespace

bool stays(const fs::path& path) {
  std::error_code ignored;
  return fs::is_other(path, ignored) || !system_link_of(path).empty();
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return place_of(a) == place_of(b) || fs::equivalent(a, b, ignored);
}

Result<void> write_files(const std::vector<FileText>& files) {
  std::error_code ignored;
  std::vector<std::pair<const FileText*, fs::path>> replaced;  // with what replaces it
  const auto give_up = [&](Error error) {
    for (const auto& [file, part] : replaced) fs::remove(part, ignored);
    return error;
  };
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i].path.empty() || stays(files[i].path)) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (!files[j].path.empty() && same_file(files[i].path, files[j].path)) {
        return Error{Errc::bad_value, fmt::format("{}: is named twice; give two files", files[i].path.string())};
      }
    }
  }
  for (const FileText& file : files) {
    if (file.path.empty() || stays(file.path)) continue;
    if (fs::is_directory(file.path, ignored)) {
      return give_up({Errc::unreadable, fmt::format("{}: is a folder; give a file", file.path.string())});
    }
    fs::path& part = replaced.emplace_back(&file, fs::path()).second;
    if (auto written = put_part(file, part); !written) return give_up(written.error());
    if (auto synced = sync_file(part); !synced) return give_up(synced.error());
  }
  std::set<fs::path> folders;
  for (const auto& [file, part] : replaced) {
    std::error_code error;
    fs::rename(part, file->path, error);
    if (error) return give_up({Errc::unreadable, fmt::format("{}: cannot be replaced", file->path.string())});
    folders.insert(file->path.parent_path());
  }
  for (const fs::path& folder : folders) {
    if (auto synced = sync_folder(folder); !synced) return synced;
  }
  for (const FileText& file : files) {
    if (file.path.empty() || !stays(file.path)) continue;
    if (auto written = put_as_it_is(file); !written) return written;
  }
  return {};
}

Result<void> write_file(const fs::path& path, const std::string& text) {
  return write_files({{path, text}});
}

std::string text_of(const nlohmann::json& json) {
  return calibration::text_of_json(json, 2) + "\n";
}

}  // namespace birdseye::host
