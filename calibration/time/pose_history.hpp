#pragma once

#include <deque>
#include <optional>
#include <string>

#include "calibration/geometry/transform.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye {

enum class PoseKind {
  exact,         ///< a sample was taken at this very time
  interpolated,  ///< between samples before and after
  predicted,     ///< past the newest sample, within the limit
  refused,       ///< no pose: the reason says why
};
const char* to_string(PoseKind kind);

/// The pose at the time that was asked for, and how it was obtained.
struct PoseAnswer {
  PoseKind kind = PoseKind::refused;
  std::optional<Transform<Tracker, Sensor>> tracker_from_sensor;  ///< empty exactly when refused
  /// Per axis: from the scatter of the samples about the fit (0 where there are too few), and from what the hand may
  /// have done between or after them. What an error of time_sigma makes at this speed comes on top.
  double position_sigma_mm = 0;
  Duration time_sigma;    ///< of the samples used
  double speed_mm_s = 0;  ///< 0 for a single sample
  Duration age;           ///< from the newest sample to the time asked for; negative where samples are newer
  std::string reason;     ///< why refused or predicted, in words
};

/// The recent poses of one bird, asked for at a time. Bounded; samples come in order of time.
class PoseHistory {
 public:
  struct Settings {
    std::size_t capacity = 4096;                       ///< 40 s of a miniBIRD: a frame may come late from a busy camera
    Duration max_gap = Duration::from_ms(60);          ///< wider holes are not bridged
    Duration max_prediction = Duration::from_ms(100);  ///< further ahead is refused
    Duration max_time_sigma = Duration::from_ms(10);   ///< poses whose time is less sure are refused
    double acceleration_mm_s2 = 500;                   ///< of a hand, per axis: how predictions grow worse with time
    /// Half the width of a window of samples to which a line is fitted (position along it, rotation about one axis), to
    /// average the tracker's noise. 0 interpolates between the two neighbours. A prediction is made from the whole
    /// window's width before the newest sample, and from no less than least_predicted_from: of two neighbours' noise it
    /// would be many times as much.
    Duration smoothing{0};
    Duration least_predicted_from = Duration::from_ms(60);
  };

  PoseHistory() = default;
  explicit PoseHistory(const Settings& settings) : settings_(settings) {}

  /// False, and nothing kept, where acquired is not after the newest sample's.
  bool push(DeviceTime acquired, Duration sigma, const Transform<Tracker, Sensor>& tracker_from_sensor);
  [[nodiscard]] PoseAnswer at(DeviceTime time) const;
  [[nodiscard]] std::optional<DeviceTime> newest() const;

 private:
  struct Sample {
    DeviceTime acquired;
    Duration sigma;
    Transform<Tracker, Sensor> pose;
  };
  /// Samples begin to end, without a gap between them.
  struct Range {
    std::ptrdiff_t begin = 0, end = 0, reference = 0;
  };
  [[nodiscard]] const Sample& sample(std::ptrdiff_t i) const { return samples_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] Range around(DeviceTime time, std::ptrdiff_t first_after) const;
  void fit(DeviceTime time, const Range& range, PoseAnswer& answer) const;
  void judge_time(const Range& range, PoseAnswer& answer) const;

  Settings settings_;
  std::deque<Sample> samples_;
};

}  // namespace birdseye
