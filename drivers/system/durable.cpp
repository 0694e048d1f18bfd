#include "drivers/system/durable.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <vector>

#include "drivers/system/disk_keeper.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye {

namespace {

/// Gives the number of an error, or 0.
int sync_by_kernel(const std::filesystem::path& path, int flags) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | flags));
  // Some file systems that are reached over a network cannot sync a folder, and say so by EINVAL.
  return fd && (::fsync(fd.get()) == 0 || errno == EINVAL) ? 0 : errno;
}

Result<void> sync(const std::filesystem::path& path, int flags) {
  DiskKeeper* const keeper = DiskKeeper::present();
  const int error = keeper != nullptr ? keeper->sync(path) : sync_by_kernel(path, flags);
  if (error == 0) return {};
  return Error{Errc::io, fmt::format("{}: cannot be brought onto the disk ({}); is it full, or gone?", path.string(),
                                     std::strerror(error))};
}

}  // namespace

Result<void> sync_file(const std::filesystem::path& path) {
  return sync(path, 0);
}

Result<void> sync_folder(const std::filesystem::path& folder) {
  return sync(folder.empty() ? "." : folder, O_DIRECTORY);
}

Result<void> make_folder_durably(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> parents;  // of all that are not there
  auto at = folder.has_filename() ? folder : folder.parent_path();
  for (; !at.empty() && !std::filesystem::exists(at, error); at = at.parent_path()) parents.push_back(at.parent_path());
  std::filesystem::create_directories(folder, error);
  if (error)
    return Error{Errc::unreadable,
                 fmt::format("{}: the folder cannot be made ({}); choose another", folder.string(), error.message())};
  for (const auto& parent : parents) {
    if (auto synced = sync_folder(parent); !synced) return synced;
  }
  return {};
}

Result<void> replace_durably(const std::filesystem::path& written, const std::filesystem::path& place) {
  if (auto synced = sync_file(written); !synced) return synced;
  std::error_code error;
  std::filesystem::rename(written, place, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be replaced", place.string())};
  return sync_folder(place.parent_path());
}

}  // namespace birdseye
