#include "host/files/write_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "calibration/record/strict_json.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

fs::path part_of(const fs::path& path) {
  return path.string() + ".part";
}

/// flags: O_EXCL for a file that is made here, and nothing for a device or a pipe that is there, which is not waited
/// for: one that nobody reads is refused.
Result<void> put(const fs::path& path, const std::string& text, int flags, const fs::path& named) {
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK | flags, 0666));
  if (!fd && errno == ENXIO)
    return Error{Errc::unreadable, fmt::format("{}: nobody reads this pipe; start its reader first", named.string())};
  if (!fd && errno == EEXIST)
    return Error{Errc::unreadable, fmt::format("{}: is in the way; remove it", path.string())};
  bool written = static_cast<bool>(fd);
  if (written && ::fcntl(fd.get(), F_SETFL, 0) != 0) written = false;
  for (std::size_t at = 0; written && at < text.size();) {
    const ssize_t wrote = ::write(fd.get(), text.data() + at, text.size() - at);
    if (wrote < 0 && errno == EINTR) continue;
    written = wrote > 0;
    if (written) at += static_cast<std::size_t>(wrote);
  }
  if (written) return {};
  return Error{Errc::unreadable,
               fmt::format("{}: cannot be written; check the folder, its permissions, and whether the disk is full",
                           named.string())};
}

/// Beside the file, in a file of its own: whatever lay there under that name, as a link to another file, is not written
/// to.
Result<void> put_part(const FileText& file) {
  const fs::path part = part_of(file.path);
  (void)::unlink(part.c_str());  // where it cannot be removed, O_EXCL refuses it
  return put(part, file.text, O_EXCL | O_NOFOLLOW, file.path);
}

}  // namespace

Result<void> write_files(const std::vector<FileText>& files) {
  std::error_code ignored;
  std::vector<const FileText*> replaced;
  const auto give_up = [&](Error error) {
    for (const FileText* file : replaced) fs::remove(part_of(file->path), ignored);
    return error;
  };
  for (std::size_t i = 0; i < files.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!files[i].path.empty() && files[i].path == files[j].path) {
        return Error{Errc::bad_value, fmt::format("{}: is named twice; give two files", files[i].path.string())};
      }
    }
  }
  for (const FileText& file : files) {
    if (file.path.empty() || fs::is_other(file.path, ignored)) continue;
    if (fs::is_directory(file.path, ignored)) {
      return give_up({Errc::unreadable, fmt::format("{}: is a folder; give a file", file.path.string())});
    }
    replaced.push_back(&file);
    if (auto written = put_part(file); !written) return give_up(written.error());
    if (auto synced = sync_file(part_of(file.path)); !synced) return give_up(synced.error());
  }
  std::set<fs::path> folders;
  for (const FileText* file : replaced) {
    std::error_code error;
    fs::rename(part_of(file->path), file->path, error);
    if (error) return give_up({Errc::unreadable, fmt::format("{}: cannot be replaced", file->path.string())});
    folders.insert(file->path.parent_path());
  }
  for (const fs::path& folder : folders) {
    if (auto synced = sync_folder(folder); !synced) return synced;
  }
  for (const FileText& file : files) {
    if (file.path.empty() || !fs::is_other(file.path, ignored)) continue;
    if (auto written = put(file.path, file.text, 0, file.path); !written) return written;
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
