#include "tests/support/rendered_board.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/base/units.hpp"

namespace birdseye::testing {

using calibration::Pattern;
using calibration::PatternKind;

namespace {

constexpr double kBeyond = 0.35;   // what lies behind the board
constexpr double kFalloff = 0.35;  // less light in the picture's corners, a share

cv::Mat motion_kernel(double length_px, double deg) {
  const int half = static_cast<int>(std::ceil(length_px / 2)) + 1;
  cv::Mat kernel = cv::Mat::zeros(2 * half + 1, 2 * half + 1, CV_32F);
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps; ++i) {
    const double t = length_px * ((i + 0.5) / kSteps - 0.5);
    const double x = half + t * std::cos(deg / kDegPerRad);
    const double y = half + t * std::sin(deg / kDegPerRad);
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    for (int k = 0; k < 4; ++k) {
      const double fx = k % 2 == 1 ? x - column : 1 - (x - column);
      const double fy = k / 2 == 1 ? y - row : 1 - (y - row);
      kernel.at<float>(row + k / 2, column + k % 2) += static_cast<float>(fx * fy / kSteps);
    }
  }
  return kernel;
}

}  // namespace

BoardArt::BoardArt(const Pattern& pattern) : pattern_(pattern) {
  if (pattern.kind != PatternKind::charuco) return;
  const auto dictionary = cv::aruco::getPredefinedDictionary(pattern.dictionary);
  for (int id = 0; id < dictionary->bytesList.rows; ++id)
    cv::aruco::drawMarker(dictionary, id, dictionary->markerSize + 2, tags_.emplace_back(), 1);
  // New: the first square is black. Old: the first one of the last row is. Tags are numbered along the rows.
  const int black = pattern.legacy ? (pattern.rows - 1) % 2 : 0;
  int next = 0;
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column)
      tag_of_square_.push_back((column + row) % 2 == black ? -1 : next++);
  }
}

double BoardArt::at(double x_mm, double y_mm) const {
  const double x = x_mm / pattern_.spacing_mm;
  const double y = y_mm / pattern_.spacing_mm;
  if (const double within = inset(x_mm, y_mm); within >= 0) return within;
  return pattern_.kind == PatternKind::charuco ? charuco(x, y) : chessboard(x, y);
}

double BoardArt::inset(double x_mm, double y_mm) const {
  constexpr double kBorder = 0.7;  // squares
  if (pattern_.inset_columns == 0) return -1;
  const int columns = pattern_.inset_columns + 1, rows = pattern_.inset_rows + 1;
  const double x = (x_mm - 0.5 * pattern_.columns * pattern_.spacing_mm) / pattern_.inset_mm + 0.5 * columns;
  const double y = (y_mm - 0.5 * pattern_.rows * pattern_.spacing_mm) / pattern_.inset_mm + 0.5 * rows;
  if (x < -kBorder || y < -kBorder || x > columns + kBorder || y > rows + kBorder) return -1;
  if (x < 0 || y < 0 || x >= columns || y >= rows) return 1;
  return (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0 ? 1 : 0;
}

double BoardArt::chessboard(double x, double y) const {
  if (x < -2 || y < -2 || x > pattern_.columns + 1 || y > pattern_.rows + 1) return kBeyond;
  if (x < -1 || y < -1 || x > pattern_.columns || y > pattern_.rows) return 1;
  return (static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y))) % 2 == 0 ? 0 : 1;
}

double BoardArt::charuco(double x, double y) const {
  if (x < -1 || y < -1 || x > pattern_.columns + 1 || y > pattern_.rows + 1) return kBeyond;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  if (x < 0 || y < 0 || column >= pattern_.columns || row >= pattern_.rows) return 1;
  const int tag = tag_of_square_[static_cast<std::size_t>(row * pattern_.columns + column)];
  if (tag < 0) return 0;
  const cv::Mat& modules = tags_[static_cast<std::size_t>(tag)];
  const double side = pattern_.tag_mm / pattern_.spacing_mm;
  const double u = (x - column - 0.5) / side + 0.5;
  const double v = (y - row - 0.5) / side + 0.5;
  if (u < 0 || v < 0 || u >= 1 || v >= 1) return 1;
  return modules.at<std::uint8_t>(static_cast<int>(v * modules.rows), static_cast<int>(u * modules.cols)) > 127 ? 1 : 0;
}

BoardPainter::BoardPainter(const CameraModel& camera) : camera_(camera) {
  for (int y = 0; y <= camera.height_px; ++y) {
    for (int x = 0; x <= camera.width_px; ++x)
      rays_.push_back(unproject(camera, {x - 0.5, y - 0.5}).value_or(Eigen::Vector3d::Zero()));
  }
}

cv::Mat BoardPainter::paint(const Pattern& pattern, const Transform<Camera, Marker>& camera_from_marker,
                            const Shot& shot) const {
  // Marker's x and y of a ray's point times its depth: a homography.
  Eigen::Matrix3d camera_from_plane;
  camera_from_plane << camera_from_marker.rotation().col(0), camera_from_marker.rotation().col(1),
      camera_from_marker.translation();
  const Eigen::Matrix3d plane_from_camera = camera_from_plane.inverse();
  std::vector<Eigen::Vector2d> places(rays_.size());
  std::transform(rays_.begin(), rays_.end(), places.begin(),
                 [&](const Eigen::Vector3d& ray) { return Eigen::Vector2d((plane_from_camera * ray).hnormalized()); });
  const BoardArt art(pattern);
  cv::Mat picture(camera_.height_px, camera_.width_px, CV_32F);
  const auto across = static_cast<std::size_t>(camera_.width_px) + 1;
  constexpr int kFine = 4;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const Eigen::Vector2d* top = &places[static_cast<std::size_t>(y) * across + static_cast<std::size_t>(x)];
      const Eigen::Vector2d* bottom = top + across;
      double sum = 0;
      for (int k = 0; k < kFine * kFine; ++k) {
        const double fx = (k % kFine + 0.5) / kFine;
        const double fy = (k / kFine + 0.5) / kFine;
        const Eigen::Vector2d place =
            (1 - fy) * ((1 - fx) * top[0] + fx * top[1]) + fy * ((1 - fx) * bottom[0] + fx * bottom[1]);
        sum += art.at(place.x(), place.y());
      }
      const double reach = Eigen::Vector2d(2.0 * x / picture.cols - 1, 2.0 * y / picture.rows - 1).squaredNorm() / 2;
      picture.at<float>(y, x) =
          static_cast<float>((shot.dark + (shot.light - shot.dark) * sum / (kFine * kFine)) * (1 - kFalloff * reach));
    }
  }
  if (shot.blur_px > 0) cv::GaussianBlur(picture, picture, {0, 0}, shot.blur_px);
  if (shot.motion_px > 0) cv::filter2D(picture, picture, -1, motion_kernel(shot.motion_px, shot.motion_deg));
  if (shot.glare_radius_px > 0) {
    cv::Mat light = cv::Mat::zeros(picture.size(), CV_32F);
    cv::circle(light, cv::Point2d(shot.glare_px.x(), shot.glare_px.y()), static_cast<int>(shot.glare_radius_px), 400,
               cv::FILLED);
    cv::GaussianBlur(light, light, {0, 0}, 4);
    picture += light;
  }
  std::mt19937 rng(shot.seed);
  std::normal_distribution<double> noise(0, shot.noise);
  cv::Mat grey(picture.size(), CV_8U);
  std::transform(picture.begin<float>(), picture.end<float>(), grey.begin<std::uint8_t>(), [&](float value) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(rng)), 0L, 255L));
  });
  return grey;
}

Transform<Camera, Marker> held(const Pattern& pattern, const Eigen::Vector3d& middle_in_camera_mm, double tilt_deg,
                               double tilt_axis_deg, double turn_deg) {
  const auto points = pattern_points_mm(pattern);
  const Eigen::Vector3d middle = 0.5 * (points.front() + points.back());
  const double axis = tilt_axis_deg / kDegPerRad;
  const Eigen::Matrix3d rotation =
      rotation_exp(tilt_deg / kDegPerRad * Eigen::Vector3d(std::cos(axis), std::sin(axis), 0)) *
      rotation_exp({0, 0, turn_deg / kDegPerRad});
  return {rotation, Eigen::Vector3d(middle_in_camera_mm - rotation * middle)};
}

CameraModel barrel_camera() {
  CameraModel camera;
  camera.width_px = 960;
  camera.height_px = 600;
  camera.fx_px = camera.fy_px = 640;
  camera.cx_px = 475;
  camera.cy_px = 305;
  camera.k1 = -0.4;
  camera.k2 = 0.12;
  return camera;
}

const BoardPainter& barrel_painter() {
  static const BoardPainter one(barrel_camera());
  return one;
}

}  // namespace birdseye::testing
