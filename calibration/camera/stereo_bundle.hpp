#pragma once

#include "calibration/camera/camera_bundle.hpp"
#include "calibration/camera/stereo_calibration.hpp"

namespace birdseye::calibration {

/// One board in two pictures. The board's pose is `left`'s; `right`'s pose is unused.
struct BundlePair {
  BundleView left, right;
};

struct StereoBundle {
  CameraModel left, right;
  std::array<bool, CameraModel::kParameters> left_solved{}, right_solved{};
  Transform<RightCamera, Camera> right_from_left;
  std::vector<BundlePair> pairs;
};

/// Least squares over both lenses, the cameras' relation and all boards, in place.
void refine_stereo(StereoBundle& bundle, const BundleSettings& settings = {});

/// Inverse of the normal matrix for the relation's turn and shift; times the residuals' variance it is a covariance.
Eigen::Matrix<double, 6, 6> relation_cofactor(const StereoBundle& bundle);

/// Seen minus predicted in the right picture of a pair.
std::vector<Eigen::Vector2d> right_residuals_px(const StereoBundle& bundle, const BundlePair& pair);

}  // namespace birdseye::calibration
