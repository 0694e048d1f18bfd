#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "device/birdseyed/record_file.hpp"

namespace birdseye::hw_sim {

/// The disk that an appliance records to: in a power cut it loses what was not synced, or some of it.
class RecordingsDisk {
 public:
  /// folder: there already. machine: signs what is recorded.
  RecordingsDisk(std::filesystem::path folder, ThisMachine machine, std::uint64_t seed);

  /// For RecordConfig: begins the next file. One at a time.
  Result<device::NewRecordFile> create();
  /// The power goes: what is written from now on is lost, and of what was not synced the seed decides how much is left,
  /// and whether its end is zeros.
  void lose_power();
  /// The file that was begun last.
  [[nodiscard]] const std::filesystem::path& last() const { return last_; }

  struct Written;

 private:
  std::filesystem::path folder_, last_;
  ThisMachine machine_;
  std::uint64_t seed_, begun_ = 0;
  std::shared_ptr<Written> written_;  ///< of the last file
};

}  // namespace birdseye::hw_sim
