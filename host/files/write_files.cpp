#include "host/files/write_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
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

/// A device or a pipe that is there. It is not waited for: one that nobody reads is refused.
Result<UniqueFd> open_as_it_is(const fs::path& path) {
  if (UniqueFd own = own_descriptor(path)) return own;
  UniqueFd fd(::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!fd && errno == ENXIO)
    return Error{Errc::unreadable, fmt::format("{}: nobody reads this pipe; start its reader first", path.string())};
  if (!fd || ::fcntl(fd.get(), F_SETFL, O_APPEND) != 0) return cannot_be_written(path);
  return fd;
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

/// A file on its way to its place, and the former file until all files have got there.
struct Replacement {
  const FileText* file;
  fs::path part = {};    ///< what replaces the file
  fs::path former = {};  ///< a further name of the former file; empty: there was none, or it has no such name
  bool is_new = false;   ///< there was no former file
  bool is_done = false;  ///< it is in its place

  /// By a hard link: until it is replaced, the former file stays in its place.
  void keep_former() {
    std::error_code ignored;
    is_new = fs::symlink_status(file->path, ignored).type() == fs::file_type::not_found;
    if (is_new) return;
    former =
        take_part_name(file->path, [&](const fs::path& name) { return ::link(file->path.c_str(), name.c_str()) == 0; });
  }
  bool replace() {
    is_done = std::rename(part.c_str(), file->path.c_str()) == 0;
    return is_done;
  }
  void forget_former() const {
    std::error_code ignored;
    if (!former.empty()) fs::remove(former, ignored);
  }
  /// Whether all is as it was.
  [[nodiscard]] bool put_back() const {
    std::error_code ignored;
    if (!is_done) {
      fs::remove(part, ignored);
      forget_former();
      return true;
    }
    if (is_new) return fs::remove(file->path, ignored);
    return !former.empty() && std::rename(former.c_str(), file->path.c_str()) == 0;
  }
};

/// The error, with what could not be put back.
Error put_all_back(const std::vector<Replacement>& replaced, Error error) {
  std::vector<std::string> names;
  for (const Replacement& one : replaced) {
    if (!one.put_back()) names.push_back(one.file->path.string());
  }
  if (!names.empty()) error.what += fmt::format(" (replaced already, and not put back: {})", fmt::join(names, ", "));
  return error;
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
  std::vector<Replacement> replaced;
  const auto give_up = [&](Error error) { return put_all_back(replaced, std::move(error)); };
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (files[i].path.empty() || stays(files[i].path)) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (!files[j].path.empty() && same_file(files[i].path, files[j].path)) {
        return Error{Errc::bad_value, fmt::format("{}: is named twice; give two files", files[i].path.string())};
      }
    }
  }
  std::vector<std::pair<const FileText*, UniqueFd>> as_they_are;
  for (const FileText& file : files) {
    if (file.path.empty()) continue;
    if (stays(file.path)) {
      auto fd = open_as_it_is(file.path);
      if (!fd) return give_up(fd.error());
      as_they_are.emplace_back(&file, *std::move(fd));
      continue;
    }
    if (fs::is_directory(file.path, ignored)) {
      return give_up({Errc::unreadable, fmt::format("{}: is a folder; give a file", file.path.string())});
    }
    fs::path& part = replaced.emplace_back(Replacement{.file = &file}).part;
    if (auto written = put_part(file, part); !written) return give_up(written.error());
    if (auto synced = sync_file(part); !synced) return give_up(synced.error());
  }
  if (replaced.size() > 1) {
    for (Replacement& one : replaced) one.keep_former();
  }
  for (Replacement& one : replaced) {
    if (!one.replace()) {
      return give_up({Errc::unreadable,
                      fmt::format("{}: cannot be replaced; check whose file and folder it is, or name another file",
                                  one.file->path.string())});
    }
  }
  std::set<fs::path> folders;
  for (const Replacement& one : replaced) {
    one.forget_former();
    folders.insert(one.file->path.parent_path());
  }
  for (const fs::path& folder : folders) {
    if (auto synced = sync_folder(folder); !synced) return synced;
  }
  for (const auto& [file, fd] : as_they_are) {
    if (auto written = put(fd, *file); !written) return written;
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
