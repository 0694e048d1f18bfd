#pragma once

#include <Eigen/Core>

namespace birdseye {

/// The round field of a laparoscope in the camera's picture, or as much of it as the sensor holds: dark around it. Its
/// size goes with the focal length, so that a lens that is zoomed shows another.
struct RoundField {
  Eigen::Vector2d centre_px{0, 0};
  double radius_px = 0;
  bool operator==(const RoundField&) const = default;
};

}  // namespace birdseye
