#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::host {

/// The files that a recording wrote into its folder, with the sums of the bytes that it wrote: these are signed, and
/// not whatever lies in the folder in the end.
class RecordingFiles {
 public:
  /// Of a folder that is there.
  static Result<RecordingFiles> open(const std::filesystem::path& folder);

  void wrote(const std::string& name, const std::string& sha256) { sums_[name] = sha256; }
  /// Refuses, naming it, where the folder was removed or renamed, or another is in its place.
  [[nodiscard]] Result<void> check_folder() const;
  /// Which of the files do not lie in the folder as they were written, in words. Reads all of them.
  [[nodiscard]] std::vector<std::string> damage() const;
  /// The names of what else lies in the folder, but for the sheet.
  [[nodiscard]] std::vector<std::string> others() const;
  /// By name.
  [[nodiscard]] const std::map<std::string, std::string>& sums() const { return sums_; }

 private:
  RecordingFiles(std::filesystem::path folder, UniqueFd fd) : folder_(std::move(folder)), fd_(std::move(fd)) {}
  std::filesystem::path folder_;
  UniqueFd fd_;
  std::map<std::string, std::string> sums_;
};

/// The names of all files in a recording's folder but the sheet, in order.
Result<std::vector<std::string>> files_in_recording(const std::filesystem::path& folder);

}  // namespace birdseye::host
