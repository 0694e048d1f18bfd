#include "drivers/system/part_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "drivers/system/durable.hpp"

namespace birdseye {

namespace fs = std::filesystem;

namespace {

/// Who may read the former file, if there is one, and no others may read the new one.
Result<void> keep_mode(const fs::path& written, const fs::path& place) {
  struct stat former = {}, now = {};
  if (::stat(place.c_str(), &former) != 0 || ::stat(written.c_str(), &now) != 0) return {};
  const mode_t mode = former.st_mode & 0777;
  if ((now.st_mode & 0777) == mode || ::chmod(written.c_str(), mode) == 0) return {};
  return Error{Errc::unreadable,
               fmt::format("{}: its permissions cannot be kept; write to another place", place.string())};
}

Error cannot_be_written(const fs::path& place) {
  return {Errc::unreadable,
          fmt::format("{}: cannot be written; check the folder and its permissions, and whether the disk is full",
                      place.string())};
}

}  // namespace

fs::path take_part_name(const fs::path& place, const std::function<bool(const fs::path&)>& take) {
  for (int n = 0;; ++n) {
    fs::path part = place.parent_path() / fmt::format(".{}.part", n);
    errno = 0;
    if (take(part)) return part;
    if (errno != EEXIST) return {};
  }
}

Result<PartFile> PartFile::make(const fs::path& place) {
  std::error_code ignored;
  if (fs::is_directory(place, ignored) || !place.has_filename())
    return Error{Errc::unreadable, fmt::format("{}: is a folder; give a file", place.string())};
  if (fs::is_other(place, ignored))
    return Error{Errc::unreadable, fmt::format("{}: is a pipe or a device; give a file", place.string())};
  fs::path folder = take_part_name(place, [](const fs::path& name) { return ::mkdir(name.c_str(), 0700) == 0; });
  if (folder.empty()) return cannot_be_written(place);
  return PartFile(place, std::move(folder));
}

PartFile& PartFile::operator=(PartFile&& other) noexcept {
  std::swap(place_, other.place_);
  std::swap(folder_, other.folder_);
  return *this;
}

PartFile::~PartFile() {
  remove();
}

void PartFile::remove() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
  folder_.clear();
}

Result<void> PartFile::put_durably() {
  if (auto synced = sync_file(path()); !synced) return synced;
  if (auto kept = keep_mode(path(), place_); !kept) return kept;
  std::error_code error;
  fs::rename(path(), place_, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be replaced", place_.string())};
  remove();  // before the names in the folder are brought onto the disk
  return sync_folder(place_.parent_path());
}

Result<void> write_durably(const fs::path& place, std::string_view text, fs::perms of_new) {
  auto part = PartFile::make(place);
  if (!part) return part.error();
  std::ofstream out(part->path(), std::ios::binary);
  out << text;
  out.close();
  std::error_code failed;
  if (of_new != fs::perms::unknown) fs::permissions(part->path(), of_new, failed);
  if (!out || failed) return cannot_be_written(place);
  return part->put_durably();
}

}  // namespace birdseye
