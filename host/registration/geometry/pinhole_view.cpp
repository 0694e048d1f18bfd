#include "host/registration/geometry/pinhole_view.hpp"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "calibration/geometry/lens_fold.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::host {

namespace {

/// Where in the picture each pixel of the pinhole camera lies; outside of it where the lens sees nothing.
std::pair<cv::Mat, cv::Mat> lens_map(const CameraModel& camera) {
  constexpr double kOutside_px = -8;
  cv::Mat x(camera.height_px, camera.width_px, CV_32F), y(camera.height_px, camera.width_px, CV_32F);
  const double fold = fold_radius(camera);
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const Eigen::Vector3d ray((column - camera.cx_px) / camera.fx_px, (row - camera.cy_px) / camera.fy_px, 1);
      const Eigen::Vector2d pixel = project_seen(camera, ray, fold).value_or(Eigen::Vector2d::Constant(kOutside_px));
      x.at<float>(row, column) = static_cast<float>(pixel.x());
      y.at<float>(row, column) = static_cast<float>(pixel.y());
    }
  }
  return {x, y};
}

/// What of a picture moves with the organ: log of its grey, without what changes slowly across it, such as shading and
/// the halo of a highlight, which move with the lamp. NaN where a pixel does not count.
cv::Mat texture_of(const cv::Mat& grey, const cv::Mat& usable) {
  constexpr double kFine_px = 1, kCoarse_px = 3, kWidth_px = 768, kDark = 8, kFew = 1e-3;
  const double coarse_px = std::max(2 * kFine_px, kCoarse_px * grey.cols / kWidth_px);
  cv::Mat bright, fine, weight, weight_about, about;
  cv::log(grey + kDark, bright);
  cv::GaussianBlur(bright, fine, {}, kFine_px);
  usable.convertTo(weight, CV_32F, 1 / 255.0);
  cv::GaussianBlur(bright.mul(weight), about, {}, coarse_px);
  cv::GaussianBlur(weight, weight_about, {}, coarse_px);
  cv::Mat out = fine - about / cv::max(weight_about, kFew);
  out.setTo(std::numeric_limits<float>::quiet_NaN(), usable == 0);
  return out;
}

cv::Mat disc(int radius_px) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius_px + 1, 2 * radius_px + 1});
}

}  // namespace

PinholeView moved(PinholeView view, const Transform<Camera, Patient>& camera_from_patient) {
  view.camera_from_patient = camera_from_patient;
  view.eye_in_patient_mm = camera_from_patient.inverse().translation();
  return view;
}

PinholeView pinhole_view(const VideoView& view, const RgbView& picture) {
  constexpr int kRim_px = 4, kGlareRim_px = 4, kMaskRim_px = 2;
  constexpr double kGlare = 235;
  const CameraModel& camera = view.camera;
  PinholeView out;
  out.width_px = camera.width_px;
  out.height_px = camera.height_px;
  out.fx_px = camera.fx_px;
  out.fy_px = camera.fy_px;
  out.cx_px = camera.cx_px;
  out.cy_px = camera.cy_px;
  out.camera_from_patient = view.camera_from_patient;
  out.eye_in_patient_mm = view.camera_from_patient.inverse().translation();
  const cv::Mat rgb = mat_of(picture), counts = mat_of(GreyView{view.mask, camera.width_px, camera.height_px});
  const auto [x, y] = lens_map(camera);
  cv::remap(rgb, out.colour, x, y, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  std::vector<cv::Mat> channels;
  cv::split(rgb, channels);
  cv::Mat sum, grey, glare;
  cv::add(channels[0], channels[1], sum, {}, CV_32F);
  cv::add(sum, channels[2], sum, {}, CV_32F);
  sum /= 3;
  cv::remap(sum, grey, x, y, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  cv::GaussianBlur(grey, out.smooth, {}, 1.0);
  const cv::Mat brightest = cv::max(cv::max(channels[0], channels[1]), channels[2]), seen = counts != 0;
  cv::dilate(brightest > kGlare, glare, disc(kGlareRim_px));
  // What the mask leaves out for its glare is no rim of the lens.
  cv::Mat lens = seen | glare;
  cv::morphologyEx(lens, lens, cv::MORPH_CLOSE, disc(kGlareRim_px));
  cv::erode(lens, lens, disc(kRim_px), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  cv::remap(lens, out.lens, x, y, cv::INTER_NEAREST, cv::BORDER_CONSTANT);
  cv::Mat usable;
  cv::erode(seen, usable, disc(kMaskRim_px), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  usable = usable & ~glare & lens;
  cv::remap(usable, out.usable, x, y, cv::INTER_NEAREST, cv::BORDER_CONSTANT);
  out.texture = texture_of(grey, out.usable);
  return out;
}

}  // namespace birdseye::host
