#include "host/recording/recording_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "drivers/system/same_file.hpp"
#include "host/files/files_sha256.hpp"
#include "host/recording/output_file.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

Result<RecordingFiles> RecordingFiles::open(const fs::path& folder) {
  UniqueFd fd(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", folder.string())};
  return RecordingFiles(folder, std::move(fd));
}

Result<void> RecordingFiles::check_folder() const {
  struct stat own = {}, there = {};
  const bool same = ::fstat(fd_.get(), &own) == 0 && ::stat(folder_.c_str(), &there) == 0 && is_same_file(own, there);
  if (!same) return gone_meanwhile(folder_);
  return {};
}

std::vector<std::string> RecordingFiles::damage() const {
  std::vector<std::string> out;
  for (const auto& [name, written] : sums_) {
    const auto sum = files_sha256(folder_ / name);
    if (sum && *sum == written) continue;
    const bool gone = !sum && sum.error().code == Errc::not_found;
    out.push_back((gone ? gone_meanwhile(folder_ / name) : changed_meanwhile(folder_ / name)).what);
  }
  return out;
}

std::vector<std::string> RecordingFiles::others() const {
  auto names = files_in_recording(folder_);
  if (!names) return {};
  std::erase_if(*names, [&](const std::string& name) { return sums_.contains(name); });
  return *std::move(names);
}

Result<std::vector<std::string>> files_in_recording(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name != kRecordingSheet) out.push_back(name);
  }
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be read; check its permissions", folder.string())};
  std::ranges::sort(out);
  return out;
}

}  // namespace birdseye::host
