#include "drivers/system/part_file.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <string>
#include <system_error>

#include "drivers/system/durable.hpp"

namespace birdseye {

namespace fs = std::filesystem;

Result<PartFile> PartFile::make(const fs::path& place) {
  std::error_code ignored;
  if (fs::is_directory(place, ignored) || !place.has_filename())
    return Error{Errc::unreadable, fmt::format("{}: is a folder; give a file", place.string())};
  if (fs::is_other(place, ignored))
    return Error{Errc::unreadable, fmt::format("{}: is a pipe or a device; give a file", place.string())};
  std::string folder = (place.parent_path() / "part-XXXXXX").string();
  if (::mkdtemp(folder.data()) != nullptr) return PartFile(place, folder);
  return Error{Errc::unreadable,
               fmt::format("{}: cannot be written; check the folder and its permissions, and whether the disk is full",
                           place.string())};
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
  std::error_code error;
  fs::rename(path(), place_, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be replaced", place_.string())};
  remove();  // before the names in the folder are brought onto the disk
  return sync_folder(place_.parent_path());
}

}  // namespace birdseye
