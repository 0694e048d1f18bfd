#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"
#include "calibration/hand_eye/tracked_chain.hpp"

namespace birdseye::calibration {

/// How far one station's picture is from where the tracker has the board: root mean squares, and the sums they are of.
/// mm: across the line of sight at the board; without corners, the distance of the board's origin.
struct TrackedErrors {
  double px = 0, mm = 0, squares_px = 0, squares_mm = 0, count = 0;
  std::vector<Eigen::Vector2d> seen, predicted;
};
TrackedErrors tracked_errors(const PreparedStation& p, const ChainState& state);

/// Over all stations: tracked reprojection, px; without corners the distance of the board's origin, mm. camera: of the
/// first lens, where there are corners.
double tracked_score(const HandEyeStations& stations, const std::optional<CameraModel>& camera,
                     const ChainState& state);

}  // namespace birdseye::calibration
