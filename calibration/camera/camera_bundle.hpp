#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/camera/camera_calibration.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// One view as the solver works on it. The three vectors go together.
struct BundleView {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<Eigen::Vector2d> points_px;
  std::vector<double> weights;  ///< of the squared residuals; 0 leaves a point out
  Transform<Camera, Marker> camera_from_marker;
};

struct BundleSettings {
  int most_steps = 50;
  double tolerance = 1e-15;  ///< relative change of the cost at which it stops
};

struct BundleSummary {
  bool converged = false;
  std::vector<double> rms_px;  ///< after each step, over the weights
};

/// Least squares over those parameters of the lens that `solved` names and over all views' poses. It starts from the
/// values given and overwrites them. Ceres with Schur's complement over the poses.
BundleSummary refine_bundle(CameraModel& camera, std::span<BundleView> views,
                            const std::array<bool, CameraModel::kParameters>& solved,
                            const BundleSettings& settings = {});

/// Seen minus predicted, px, for each point; a point behind the camera is off by the picture's diagonal.
std::vector<Eigen::Vector2d> residuals_px(const CameraModel& camera, const BundleView& view);

/// The pose that fits one view best with the lens as it is, starting from the view's own pose (Gauss-Newton with
/// damping).
Transform<Camera, Marker> fit_pose(const CameraModel& camera, const BundleView& view);

/// The normal matrix of the lens's nine parameters, the views' poses eliminated (Schur's complement).
CameraMatrix lens_information(const CameraModel& camera, std::span<const BundleView> views);

/// 2x6 derivative of a pixel by a small turn and shift of the camera frame's points: p -> exp(turn) p' + shift, where
/// p' is the point turned but not shifted.
Eigen::Matrix<double, 2, 6> pixel_by_pose(const Eigen::Matrix<double, 2, 3>& pixel_by_point,
                                          const Eigen::Vector3d& turned_point_mm);

}  // namespace birdseye::calibration
