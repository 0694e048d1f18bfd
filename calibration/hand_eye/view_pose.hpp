#pragma once

#include <optional>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/hand_eye/tracked_chain.hpp"

namespace birdseye::calibration {

/// The second lens of a stereo scope.
struct StereoLens {
  CameraModel camera;
  Transform<RightCamera, Camera> right_from_camera;
};

/// Corners of one picture through one lens.
struct SeenCorners {
  const CameraModel* camera = nullptr;
  Transform<RightCamera, Camera> lens_from_camera;  ///< the identity for the first lens
  const PatternView* view = nullptr;
};

/// Errors beyond this many sigmas of a corner grow as their size, not its square (P. Huber, 1964).
inline constexpr double kCornerHuberSigmas = 3;

/// The board's pose from its corners alone, and what they say of it.
struct ViewPose {
  Transform<Camera, Marker> camera_from_marker;
  Matrix6d information;  ///< inverse covariance of (rotation, translation), per unit of sigma_px
  double rms_px = 0;
};

/// Weighs corners at a pose. Empty where one of them lies behind its lens.
struct CornerSum {
  Matrix6d information = Matrix6d::Zero();  ///< sum of weight * J^T J, per px^2
  Vector6d gradient = Vector6d::Zero();     ///< sum of weight * J^T r, r = predicted less seen
  double cost = 0;                          ///< Huber's, px^2
  double squares = 0;                       ///< px^2
  std::vector<double> errors_px;
};
std::optional<CornerSum> sum_corners(const std::vector<SeenCorners>& corners, const Transform<Camera, Marker>& pose,
                                     double sigma_px);

/// Starts at the homography's two poses of a flat board (T. Collins and A. Bartoli, 2014, through OpenCV) or, for a
/// board with depth, at G. Terzakis and M. Lourakis's (2020), refines each by Gauss-Newton under Huber's weights and
/// keeps the better. sigma_px scales the weights. Refuses fewer than six corners, corners on one line, and corners that
/// the lens cannot show.
Result<ViewPose> find_view_pose(const std::vector<SeenCorners>& corners, double sigma_px);

/// Gauss-Newton from a pose that is near.
Result<ViewPose> refine_view_pose(const std::vector<SeenCorners>& corners, const Transform<Camera, Marker>& start,
                                  double sigma_px);

}  // namespace birdseye::calibration
