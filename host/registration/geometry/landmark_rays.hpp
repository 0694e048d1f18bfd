#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/registration/geometry/matched_point.hpp"

namespace birdseye::host {

/// Where a view shows a landmark.
struct LandmarkPixel {
  std::string view;  ///< its name, for messages
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  Eigen::Vector2d pixel_px;
  double sigma_px = 1;  ///< along x and along y
};

/// A landmark of the organ at rest, known there to rest_sigma_mm an axis, that one view shows or several: by least
/// squares over the rays of its pixels, and by a displacement of 50 mm an axis, which is all that is known along the
/// line of sight of a single view. Where the views disagree by more than their pixels' sigma, the covariance grows by
/// as much. Refuses, naming the view, a pixel outside the picture or where the lens sees nothing, and a landmark behind
/// the camera; and sigmas that are not positive.
Result<MatchedPoint> matched_by_rays(const Eigen::Vector3d& rest_mm, double rest_sigma_mm,
                                     std::span<const LandmarkPixel> pixels);

}  // namespace birdseye::host
