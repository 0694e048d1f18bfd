#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"

namespace birdseye::calibration {

/// A place of a plate: where it is said to be and where it was measured today.
struct CheckedPlace {
  std::string name;
  Eigen::Vector3d true_mm, measured_mm;
};

/// What one day's measurement of a plate says about the field.
struct FieldCheck {
  std::string when;          ///< of the day, for people
  double rms_mm = 0;         ///< of the places after a rigid fit
  double scale_percent = 0;  ///< by how much the tracker measures distances longer than the plate has them
  double worst_mm = 0;       ///< distance of the place that is farthest off
  std::string worst_place;
  std::vector<double> off_mm;  ///< each place; empty where it comes from a history
};

/// Refuses fewer than four places, places on a line, and places of which one of both is in cm, inches or metres.
Result<FieldCheck> check_field(const std::string& when, std::span<const CheckedPlace> places);

/// Limits of a chart of single values (W. A. Shewhart; sigma from the mean moving range over 1.128): those of the
/// first days.
struct ControlLimits {
  double mean = 0, sigma = 0;
  int days = 0;
};

inline constexpr int kLearningDays = 8;  ///< the first days of a history say what is usual

struct ControlChart {
  ControlLimits rms_mm, scale_percent;  ///< days 0: not known yet
};

/// The limits from the first kLearningDays days of a history that did not fail. Empty until there are so many days.
std::optional<ControlChart> control_chart(std::span<const FieldCheck> history);

/// What the last of the days is worth: against an absolute limit always, and against its own history by the Western
/// Electric rules (1956): one value beyond 3 sigma, two of three beyond 2 sigma on one side, eight in a row on one side
/// of the mean. An rms lower than usual is no fault.
Verdict verdict_of(std::span<const FieldCheck> history);

}  // namespace birdseye::calibration
