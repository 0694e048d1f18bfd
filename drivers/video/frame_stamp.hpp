#pragma once

#include <cstdint>
#include <optional>

#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

/// What a camera's stamps mean, and what is known of its exposure.
struct StampMeaning {
  bool start_of_exposure = false;    ///< else the end: the last pixel has been read
  Duration period;                   ///< from frame to frame
  std::optional<Duration> exposure;  ///< unknown: anything from nothing to a period
  std::optional<Duration> readout;   ///< from the end of the exposure to the last pixel; unknown: likewise
};

struct MidExposure {
  DeviceTime at;
  Duration sigma;
};

/// The middle of the exposure. Whatever is unknown enters with its mean and its spread, so that the sigma covers it.
MidExposure mid_exposure(DeviceTime stamp, const StampMeaning& meaning);

/// A camera's count of frames, of 32 bits (Video4Linux) -> one that goes up, in which every hole is a lost frame.
/// - Some drivers (v4l2loopback) number the first buffer 0 whatever comes next: a hole after it is no loss.
/// - A count that stands still is no count; one that goes back began again.
class SequenceLine {
 public:
  struct Step {
    std::uint64_t sequence = 0;
    std::uint64_t lost = 0;  ///< between the frame before and this one
  };
  Step push(std::uint32_t count);
  /// The stream was stopped and started: the next count follows from nothing.
  void restart() { last_count_.reset(); }

 private:
  std::optional<std::uint32_t> last_count_;
  bool after_first_zero_ = false;
  std::uint64_t sequence_ = 0;
};

}  // namespace birdseye::drivers
