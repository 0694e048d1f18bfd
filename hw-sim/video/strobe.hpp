#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"
#include "drivers/system/thread.hpp"
#include "drivers/system/unique_fd.hpp"
#include "hw-sim/video/camera_script.hpp"

namespace birdseye::hw_sim {

/// The camera's strobe output: high while a frame is exposed, whether that frame ever leaves or not. It is written to a
/// file as "pull-up" and "pull-down", as Linux's gpio-sim wants it for a line that the world outside drives.
class Strobe {
 public:
  static Result<Strobe> open(const std::filesystem::path& file);

  /// Drives the line from now on, until this object ends.
  void start(const CameraTiming& timing, double true_rate_hz, std::int64_t zero_ns);

 private:
  explicit Strobe(UniqueFd fd) : fd_(std::move(fd)) {}

  UniqueFd fd_;
  OwnedThread thread_;
};

}  // namespace birdseye::hw_sim
