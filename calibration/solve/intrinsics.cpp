#include "calibration/solve/intrinsics.hpp"

#include <fmt/format.h>

#include <opencv2/calib3d.hpp>

namespace birdseye::calibration {

Result<Intrinsics> solve_intrinsics(std::span<const Eigen::Vector3d> points_mm, std::span<const BoardView> views,
                                    int width_px, int height_px, Distortion distortion) {
  if (views.size() < 3) {
    return Error{
        Errc::degenerate,
        fmt::format("{} views of the board: a camera needs at least three, from different tilts", views.size())};
  }
  std::vector<cv::Point3f> board;
  for (const Eigen::Vector3d& p : points_mm) {
    board.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  }
  std::vector<std::vector<cv::Point2f>> corners;
  for (const BoardView& view : views) {
    if (view.corners_px.size() != points_mm.size()) {
      return Error{Errc::bad_value,
                   fmt::format("a view of {} corners for a board of {}", view.corners_px.size(), points_mm.size())};
    }
    std::vector<cv::Point2f>& list = corners.emplace_back();
    for (const Eigen::Vector2d& c : view.corners_px)
      list.emplace_back(static_cast<float>(c.x()), static_cast<float>(c.y()));
  }
  try {
    cv::Mat matrix, coefficients, intrinsic_sigma, extrinsic_sigma, view_errors;
    std::vector<cv::Mat> rotations, translations;
    const int flags = distortion == Distortion::radial2_tangential2 ? cv::CALIB_FIX_K3 : 0;
    const cv::TermCriteria enough(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-10);
    Intrinsics out;
    out.rms_px = cv::calibrateCamera(std::vector<std::vector<cv::Point3f>>(views.size(), board), corners,
                                     cv::Size(width_px, height_px), matrix, coefficients, rotations, translations,
                                     intrinsic_sigma, extrinsic_sigma, view_errors, flags, enough);
    CameraModel& c = out.camera;
    c.width_px = width_px;
    c.height_px = height_px;
    c.fx_px = matrix.at<double>(0, 0);
    c.fy_px = matrix.at<double>(1, 1);
    c.cx_px = matrix.at<double>(0, 2);
    c.cy_px = matrix.at<double>(1, 2);
    double* const terms[] = {&c.k1, &c.k2, &c.p1, &c.p2, &c.k3};
    for (int i = 0; i < 5 && i < static_cast<int>(coefficients.total()); ++i) *terms[i] = coefficients.at<double>(i);
    if (auto sound = check(c); !sound) return sound.error();
    for (std::size_t i = 0; i < views.size(); ++i) {
      out.view_rms_px.push_back(view_errors.at<double>(static_cast<int>(i)));
      const cv::Mat &r = rotations[i], &t = translations[i];
      out.camera_from_marker.emplace_back(
          rotation_exp(Eigen::Vector3d(r.at<double>(0), r.at<double>(1), r.at<double>(2))),
          Eigen::Vector3d(t.at<double>(0), t.at<double>(1), t.at<double>(2)));
    }
    return out;
  } catch (const cv::Exception&) {
    return Error{Errc::degenerate, "the views do not determine a camera: take more, from different tilts and places"};
  }
}

}  // namespace birdseye::calibration
