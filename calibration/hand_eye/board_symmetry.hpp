#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/hand_eye/hand_eye_fit.hpp"

namespace birdseye::calibration {

/// A board that looks the same after a `fold`-th of a turn about its middle, fold being 2 or 4. Which of its ends is
/// the first is then a guess in each picture.
struct BoardSymmetry {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  ///< in the frame Marker
  int fold = 2;

  [[nodiscard]] Transform<Marker, Marker> turned(int times) const;
};

/// For each station, by how many such turns its board must be renumbered so that all stations number it alike: the
/// turns with which the pictures turn between stations by as much as the tracker says. The first station needs none.
std::vector<int> resolve_symmetry(std::span<const SummedStation> stations, const BoardSymmetry& symmetry);

}  // namespace birdseye::calibration
