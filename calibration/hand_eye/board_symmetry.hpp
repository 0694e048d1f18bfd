#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/hand_eye/hand_eye_fit.hpp"

namespace birdseye::calibration {

/// A board that looks the same when turned about its middle by a whole circle over `fold`, 2 or 4: which of its ends is
/// the first is then a guess in each picture.
struct BoardSymmetry {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  ///< in the frame Marker
  int fold = 2;

  [[nodiscard]] Transform<Marker, Marker> turned(int times) const;
};

/// How many turns of the board each station needs for the board to be named alike in all of them: those with which the
/// pictures turn between stations by as much as the tracker says. The first needs none.
std::vector<int> resolve_symmetry(std::span<const SummedStation> stations, const BoardSymmetry& symmetry);

}  // namespace birdseye::calibration
