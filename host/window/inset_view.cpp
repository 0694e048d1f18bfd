#include "host/window/inset_view.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "host/render/scene/scene.hpp"

namespace birdseye::host {

namespace {

constexpr double kShaftMm = 120, kSightMm = 60;
// Far enough that a scope over the organ lies before us too.
constexpr double kScopeMm = 300;

}  // namespace

InsetView::InsetView(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d middle_mm = volume.patient_from_voxel * Eigen::Vector3d(0.5 * last);
  const double radius_mm = 0.5 * volume.spacing_mm.cwiseProduct(last).norm();
  camera_.width_px = kWidthPx;
  camera_.height_px = kHeightPx;
  camera_.fx_px = camera_.fy_px = 1.6 * kWidthPx;
  camera_.cx_px = 0.5 * kWidthPx;
  camera_.cy_px = 0.5 * kHeightPx;
  // LPS: x to the patient's left, y to the back, z to the head.
  const Eigen::Vector3d forward = Eigen::Vector3d(-0.45, 0.85, -0.3).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d outside_from_patient;
  outside_from_patient.row(0) = right.transpose();
  outside_from_patient.row(1) = forward.cross(right).transpose();
  outside_from_patient.row(2) = forward.transpose();
  const Eigen::Vector3d eye_mm = middle_mm - (2.6 * radius_mm + kScopeMm) * forward;
  outside_from_patient_ = Transform<Camera, Patient>(outside_from_patient, -outside_from_patient * eye_mm);
}

RenderSettings InsetView::render_settings() {
  RenderSettings settings;
  settings.step_mm = 2;
  return settings;
}

Picture InsetView::draw(const ImageRgba& ct,
                        const std::optional<Transform<Camera, Patient>>& camera_from_patient) const {
  constexpr std::uint8_t kDark = 18;
  Picture picture{kWidthPx, kHeightPx, on_grey(ct, kDark)};
  if (!camera_from_patient) return picture;
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient->inverse();
  cv::Mat canvas(kHeightPx, kWidthPx, CV_8UC3, picture.rgb.data());
  const auto line = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to, const cv::Scalar& colour, int width) {
    const auto a = project(camera_, outside_from_patient_ * (patient_from_camera * from));
    const auto b = project(camera_, outside_from_patient_ * (patient_from_camera * to));
    if (!a || !b) return;
    // A shaft that leaves the picture far off would overflow the line's whole numbers.
    constexpr double kFar = 4000;
    if (a->cwiseAbs().maxCoeff() > kFar || b->cwiseAbs().maxCoeff() > kFar) return;
    cv::line(canvas, cv::Point2d(a->x(), a->y()), cv::Point2d(b->x(), b->y()), colour, width, cv::LINE_AA);
  };
  line({0, 0, -kShaftMm}, {0, 0, 0}, cv::Scalar(200, 205, 210), 3);
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.4, 0.4}) {
      line({0, 0, 0}, Eigen::Vector3d(x, y, 1).normalized() * kSightMm, cv::Scalar(245, 190, 80), 1);
    }
  }
  return picture;
}

}  // namespace birdseye::host
