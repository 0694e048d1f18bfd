#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>

#include "calibration/base/image_view.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/registration/geometry/lens_error.hpp"
#include "host/registration/views/synthetic_view.hpp"

namespace birdseye::host {

/// A view as a pinhole camera of the same size and focal length would have taken it.
struct PinholeView {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  Transform<Camera, Patient> camera_from_patient;
  Eigen::Vector3d eye_in_patient_mm;
  std::shared_ptr<const LensError> lens_error;  ///< null: not known, and the lens taken for exact
  cv::Mat smooth;                               ///< float: grey, smoothed by a pixel
  cv::Mat texture;                              ///< float: log of grey without its slow changes; NaN where not usable
  cv::Mat colour;                               ///< 8 bits a channel, RGB
  cv::Mat lens;                                 ///< 8 bit: not 0 where the picture shows anything at all
  cv::Mat usable;                               ///< 8 bit: not 0 where moreover nothing glares

  /// Along the pixel's ray: one unit is one mm of depth.
  [[nodiscard]] Eigen::Vector3d ray(double x_px, double y_px) const {
    return camera_from_patient.rotation().transpose() *
           Eigen::Vector3d((x_px - cx_px) / fx_px, (y_px - cy_px) / fy_px, 1);
  }
  struct Pixel {
    double x_px, y_px, depth_mm;
  };
  [[nodiscard]] Pixel project(const Eigen::Vector3d& place_in_patient_mm) const {
    const Eigen::Vector3d c = camera_from_patient * place_in_patient_mm;
    return {c.x() / c.z() * fx_px + cx_px, c.y() / c.z() * fy_px + cy_px, c.z()};
  }
};

/// The view as if it had been taken from there.
PinholeView moved(PinholeView view, const Transform<Camera, Patient>& camera_from_patient);

/// picture: the view's, in colour, of its camera's size.
PinholeView pinhole_view(const VideoView& view, const RgbView& picture);

}  // namespace birdseye::host
