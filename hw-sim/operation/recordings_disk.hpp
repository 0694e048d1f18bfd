#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "calibration/time/clock.hpp"
#include "device/birdseyed/record_file.hpp"

namespace birdseye::hw_sim {

/// The disk that an appliance records to. It may be late or full, and in a power cut it loses what was not synced, or
/// some of it.
class RecordingsDisk {
 public:
  /// folder: there already. machine: signs what is recorded.
  RecordingsDisk(std::filesystem::path folder, ThisMachine machine, std::uint64_t seed);

  /// Each sync takes so long.
  void set_late(Duration late) { state_->late = late; }
  /// Full: no file is begun, and of what is written the first half is.
  void set_full(bool full) { state_->full = full; }
  /// For RecordConfig: begins the next file. One at a time.
  Result<device::NewRecordFile> create();
  /// The power goes: what is written from now on is lost, and of what was not synced the seed decides how much is left,
  /// and whether its end is zeros.
  void lose_power();
  /// The file that was begun last.
  [[nodiscard]] const std::filesystem::path& last() const { return last_; }

  /// Of the disk, which a file may outlive.
  struct State {
    Duration late{0};
    bool full = false;
  };
  struct Written;

 private:
  std::filesystem::path folder_, last_;
  ThisMachine machine_;
  std::uint64_t seed_, begun_ = 0;
  std::shared_ptr<State> state_ = std::make_shared<State>();
  std::shared_ptr<Written> written_;  ///< of the last file
};

}  // namespace birdseye::hw_sim
