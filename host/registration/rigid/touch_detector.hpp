#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// One touched point: where the tip rested, and how much its positions spread meanwhile.
struct Touch {
  Eigen::Vector3d tip_in_tracker_mm;
  double rms_mm = 0;
  int samples = 0;
};

/// Finds the points at which a tracked tip rests. The tip is at rest while a line fitted to its positions over `window`
/// moves by less than `still_mm`: a line averages the tracker's noise, which the spread of positions would not. A touch
/// is reported when the tip leaves, or is seen again after it was not for most of a window. A rest before the tip's
/// first move does not count.
class TouchDetector {
 public:
  struct Settings {
    Duration window = Duration::from_ms(300);
    double still_mm = 2.5;                       ///< 6 sigma of the fitted motion at 0.6 mm noise per axis and 100 Hz
    Duration shortest = Duration::from_ms(400);  ///< a shorter rest is a turn, not a touch
    double apart_mm = 10;                        ///< a rest nearer than this to the last touch is the same touch
  };

  TouchDetector() = default;
  explicit TouchDetector(const Settings& settings) : settings_(settings) {}

  std::optional<Touch> push(DeviceTime acquired, const Eigen::Vector3d& tip_in_tracker_mm);

 private:
  struct Sample {
    DeviceTime acquired;
    Eigen::Vector3d tip_mm;
  };
  [[nodiscard]] bool window_is_still() const;
  std::optional<Touch> finish_rest();

  Settings settings_;
  std::deque<Sample> window_;
  std::deque<Sample> rest_;
  std::optional<Eigen::Vector3d> last_mm_;
  bool has_moved_ = false;
};

}  // namespace birdseye::host
