#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "calibration/base/result.hpp"
#include "drivers/identity/this_machine.hpp"

namespace birdseye::device {

/// The file of an appliance recording. Each call may take as long as the disk takes.
class RecordFile {
 public:
  virtual ~RecordFile() = default;
  /// Writes all bytes: 0, or errno.
  virtual int write(std::span<const std::uint8_t> bytes) = 0;
  /// Brings everything written so far onto the disk, so that a power cut does not lose it: 0, or errno.
  /// ENOENT: the file was removed, or another has its name.
  virtual int sync() = 0;
};

struct NewRecordFile {
  std::unique_ptr<RecordFile> file;
  std::filesystem::path path;
  std::optional<ThisMachine> machine{};  ///< that signs it; empty: nobody does
};

/// Creates birdseyed-<UTC date and time>.berec in the folder, with -2, -3 and so on where there is one of that name.
/// Where this machine has no key, nobody signs the file, and a warning says so.
Result<NewRecordFile> create_record_file(const std::filesystem::path& folder);

struct RecordConfig {
  std::filesystem::path folder;  ///< empty: nothing is recorded
  bool frames = true;
  double most_gb = 20;  ///< of one file; then recording ends and the status says so
  /// By which the file is begun; a simulator gives its own disk.
  std::function<Result<NewRecordFile>(const std::filesystem::path& folder)> create = create_record_file;
};

}  // namespace birdseye::device
