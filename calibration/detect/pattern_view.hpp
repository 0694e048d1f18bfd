#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace birdseye::calibration {

/// What one picture shows of a calibration pattern: points known by their number, wherever in the picture they were
/// found. A partial view has fewer of them. The three vectors go together, element by element.
struct PatternView {
  std::string name;  ///< the picture's, for messages
  std::vector<int> ids;
  std::vector<Eigen::Vector3d> points_in_marker_mm;
  std::vector<Eigen::Vector2d> points_px;
};

}  // namespace birdseye::calibration
