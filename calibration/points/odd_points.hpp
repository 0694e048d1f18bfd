#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::calibration {

/// A point that does not belong where it was said to be.
struct OddPoint {
  std::size_t index = 0;
  double off_mm = 0;   ///< from where the fit of all sound points puts it
  std::string reason;  ///< how that was decided, in words
};

enum class OddPointsVerdict {
  none,        ///< nothing that chance does not explain
  named,       ///< odd points, by index
  suspected,   ///< something is off, and more than one point may be to blame: suspects
  cannot_tell  ///< too few points for any to be told from the others
};

struct OddPoints {
  OddPointsVerdict verdict = OddPointsVerdict::none;
  std::vector<OddPoint> named;
  std::vector<std::size_t> suspects;  ///< one or two of these are wrong, with 95 % probability
  double fre_without_rms_mm = 0;      ///< FRE of the points that are not named
  std::string told;                   ///< all of that in one line, fiducials counted from 1
};

/// Names up to two points of a rigid fit that are wrong: touched beside the marker, taken for another, moved.
///
/// Leaving out a wrong point drops the sum of squared residuals to what localisation error leaves. Whether a drop is
/// more than chance is decided by an F test of the 3 coordinates of each point left out against the 3 (n - m) - 6
/// degrees of freedom of the rest, corrected for the number of choices (Bonferroni): a sound set is accused in at most
/// 1 of 100 cases. Which point is wrong follows from how well the rest fits without each, and is said only with 95 %
/// certainty. Where the localisation error is given, a chi-square test is used instead, which is sharper for few
/// points.
/// Four points leave a rest of three, which fits almost anything: they are never told apart.
/// Requires what fit_points accepts.
OddPoints find_odd_points(std::span<const Eigen::Vector3d> to_mm, std::span<const Eigen::Vector3d> from_mm,
                          std::optional<double> localisation_rms_mm = std::nullopt);

}  // namespace birdseye::calibration
