#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"
#include "host/registration/geometry/seen_point.hpp"

namespace birdseye::host {

/// All strokes together have no more places than these.
inline constexpr std::size_t kMostTouchedPlaces = 500;

/// The places of the organ's surface along which the pointer's tip is stroked, patient frame, mm. A place is the mean
/// of the tip over a twentieth of a second, 2 mm or more from the place before it. Left out is a tip that is faster
/// than 200 mm/s, or gets 20 mm away within a tenth of a second before or after: it goes to the organ or from it. So is
/// a tip that was not seen for a tenth of a second before and after.
class OrganStrokes {
 public:
  /// views: how many were kept before it, for undo().
  void begin(std::size_t views);
  /// A stroke that touched no place is dropped.
  void end();
  [[nodiscard]] bool stroking() const { return stroking_; }
  /// A tip of the tracked pointer. Counts only while stroking.
  void take(DeviceTime acquired, const Eigen::Vector3d& tip_in_patient_mm);
  /// Takes the last stroke back, also one that has not ended. False, and nothing is taken back: there is none, or it is
  /// older than the last of so many views.
  bool undo(std::size_t views);
  /// Drops all strokes, also one that has not ended.
  void forget();
  /// Why no stroke can begin, in words.
  void refuse(const std::string& why) { line_ = why; }

  /// Of all strokes.
  [[nodiscard]] std::size_t places() const;
  /// In words; empty: there is nothing to say.
  [[nodiscard]] const std::string& line() const { return line_; }
  /// The places, each with its own error; shift_mm, of one axis: how far the tip may be from where all that is seen
  /// says it is.
  [[nodiscard]] std::vector<SeenPoint> touches(double shift_mm) const;

 private:
  struct Sample {
    DeviceTime at;
    Eigen::Vector3d tip_mm;
  };
  struct Stroke {
    std::size_t views_before = 0;
    std::vector<SeenPoint> places;
    DeviceTime newest;  ///< of the last place
  };
  void judge(std::size_t which);
  void tell();

  std::vector<Stroke> strokes_;  ///< with the one that has not ended
  bool stroking_ = false;
  std::deque<Sample> samples_;  ///< of the newest fifth of a second
  DeviceTime judged_;           ///< the newest sample that was looked at
  std::string line_;
};

/// How far the tip may be from where the views have it, one axis, mm: by the calibration of the pointer's tip, and by
/// hand-eye, by which the views have their places. An error that is not known counts as 1 mm.
double tip_shift_mm(std::optional<double> tip_rms_mm, std::optional<double> hand_eye_mm);

}  // namespace birdseye::host
