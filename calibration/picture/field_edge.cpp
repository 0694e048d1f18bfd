#include "calibration/picture/field_edge.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kWorkingWidthPx = 320;  // more tells no more of the edge, and takes longer
constexpr double kLeastStep = 12;     // grey levels, of the field above what is around it
constexpr double kShareOfStep = 0.25;
constexpr double kOnCircle = 0.02, kAgree = 0.02;  // of the radius
constexpr double kLeastSeen = 0.3;                 // of the circle
constexpr double kLarger = 1.05, kSmaller = 0.95;
constexpr int kDirections = 180;

/// The median of a patch in each corner, darkest first.
std::array<double, 4> corners_of(const cv::Mat& grey) {
  const int side = std::max(4, grey.rows / 16);
  std::array<double, 4> out{};
  for (std::size_t i = 0; i < 4; ++i) {
    const cv::Rect patch(i % 2 == 0 ? 0 : grey.cols - side, i < 2 ? 0 : grey.rows - side, side, side);
    std::vector<double> values;
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) values.push_back(grey.at<std::uint8_t>(patch.y + y, patch.x + x));
    out[i] = median_of(std::move(values));
  }
  std::ranges::sort(out);
  return out;
}

struct Small {
  cv::Mat grey;
  double scale = 1;  ///< pixels of the picture in one of grey
};

Small small_of(const GreyView& picture) {
  Small out;
  out.scale = std::max(1.0, static_cast<double>(picture.width_px) / kWorkingWidthPx);
  cv::resize(mat_of(picture), out.grey, {}, 1 / out.scale, 1 / out.scale, cv::INTER_AREA);
  cv::GaussianBlur(out.grey, out.grey, {3, 3}, 0);
  return out;
}

/// Grey levels around the field, and within it; empty where the two are not apart.
struct Levels {
  double around = 0, within = 0;
  [[nodiscard]] double between() const { return around + std::max(kLeastStep / 2, kShareOfStep * (within - around)); }
};

std::optional<Levels> levels_of(const cv::Mat& grey) {
  Levels out;
  out.around = corners_of(grey)[1];  // of two corners at least
  cv::Mat middle = grey({grey.cols / 4, grey.rows / 4, grey.cols / 2, grey.rows / 2});
  out.within = cv::mean(middle)[0];
  if (out.within - out.around < kLeastStep) return std::nullopt;
  return out;
}

bool at_border(const cv::Point& p, const cv::Mat& grey) {
  constexpr int kRim = 2;
  return p.x < kRim || p.y < kRim || p.x >= grey.cols - kRim || p.y >= grey.rows - kRim;
}

/// The circle through points, with least squares of x^2 + y^2 + a x + b y + c (Kasa).
RoundField circle_through(const std::vector<cv::Point>& points) {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const cv::Point& p : points) {
    const Eigen::Vector3d row(p.x, p.y, 1);
    normals += row * row.transpose();
    right -= row * (static_cast<double>(p.x) * p.x + static_cast<double>(p.y) * p.y);
  }
  const Eigen::Vector3d solved = normals.ldlt().solve(right);
  RoundField out;
  out.centre_px = -solved.head<2>() / 2;
  out.radius_px = std::sqrt(std::max(0.0, out.centre_px.squaredNorm() - solved[2]));
  return out;
}

double off_circle(const cv::Point& p, const RoundField& circle) {
  return std::abs((Eigen::Vector2d(p.x, p.y) - circle.centre_px).norm() - circle.radius_px) / circle.radius_px;
}

/// Those that lie on the circle.
std::vector<cv::Point> on_circle(const std::vector<cv::Point>& points, const RoundField& circle) {
  std::vector<cv::Point> out;
  std::ranges::copy_if(points, std::back_inserter(out),
                       [&](const cv::Point& p) { return off_circle(p, circle) < kOnCircle; });
  return out;
}

/// Of the circles through three points a third of the outline apart, the one that most points lie on: dark tissue cuts
/// a chord off the field, and a fit to all of them would lean to it.
std::vector<cv::Point> most_on_a_circle(const std::vector<cv::Point>& edge) {
  const std::size_t third = edge.size() / 3, step = std::max<std::size_t>(1, third / 60);
  std::vector<cv::Point> most;
  for (std::size_t i = 0; i < third; i += step) {
    auto on = on_circle(edge, circle_through({edge[i], edge[i + third], edge[i + 2 * third]}));
    if (on.size() > most.size()) most = std::move(on);
  }
  return most;
}

/// In pixels of the picture that the small one was made of.
std::optional<RoundField> round_field_in(const Small& small) {
  const auto levels = levels_of(small.grey);
  if (!levels) return std::nullopt;
  cv::Mat bright = small.grey > levels->between();
  cv::morphologyEx(bright, bright, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(bright, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (outlines.empty()) return std::nullopt;
  const auto& largest = *std::ranges::max_element(
      outlines, {}, [](const std::vector<cv::Point>& outline) { return cv::contourArea(outline); });
  std::vector<cv::Point> hull, edge;
  cv::convexHull(largest, hull);
  // Dark tissue at the rim bites into the outline, not into its hull.
  for (const cv::Point& p : largest) {
    if (!at_border(p, small.grey) && std::abs(cv::pointPolygonTest(hull, cv::Point2f(p), true)) < 2) edge.push_back(p);
  }
  constexpr std::size_t kFewest = 40;
  if (edge.size() < kFewest) return std::nullopt;
  const std::size_t outline = edge.size();
  edge = most_on_a_circle(edge);
  if (edge.size() < kFewest || 2 * edge.size() < outline) return std::nullopt;
  RoundField circle = circle_through(edge);
  std::vector<bool> seen(kDirections, false);
  for (const cv::Point& p : edge) {
    const double turn =
        std::atan2(p.y - circle.centre_px.y(), p.x - circle.centre_px.x()) / (2 * std::numbers::pi) + 0.5;
    seen[static_cast<std::size_t>(turn * kDirections) % kDirections] = true;
  }
  if (static_cast<double>(std::ranges::count(seen, true)) < kLeastSeen * kDirections) return std::nullopt;
  circle.centre_px = (circle.centre_px.array() + 0.5) * small.scale - 0.5;
  circle.radius_px *= small.scale;
  return circle;
}

}  // namespace

std::optional<RoundField> find_round_field(const GreyView& picture) {
  return round_field_in(small_of(picture));
}

std::optional<RoundField> agreed_round_field(std::span<const RoundField> found, std::size_t of_pictures) {
  if (found.empty() || 2 * found.size() < of_pictures) return std::nullopt;
  std::vector<double> x, y, radii;
  for (const RoundField& field : found) {
    x.push_back(field.centre_px.x());
    y.push_back(field.centre_px.y());
    radii.push_back(field.radius_px);
  }
  const RoundField out{{median_of(x), median_of(y)}, median_of(radii)};
  const auto agrees = [&](const RoundField& field) {
    return std::abs(field.radius_px - out.radius_px) < kAgree * out.radius_px &&
           (field.centre_px - out.centre_px).norm() < 2 * kAgree * out.radius_px;
  };
  return 2 * static_cast<std::size_t>(std::ranges::count_if(found, agrees)) >= of_pictures ? std::optional(out)
                                                                                           : std::nullopt;
}

FieldSize compare_round_field(const GreyView& picture, const RoundField& calibrated) {
  const Small small = small_of(picture);
  const double radius = calibrated.radius_px / small.scale;
  const Eigen::Vector2d centre = (calibrated.centre_px.array() + 0.5) / small.scale - 0.5;
  // The grey levels on a circle of so many radii about the field's centre, as far as it lies within the picture.
  const auto ring = [&](double share) {
    std::vector<double> out;
    for (int i = 0; i < kDirections; ++i) {
      const double turn = 2 * std::numbers::pi * i / kDirections;
      const int x = static_cast<int>(std::lround(centre.x() + share * radius * std::cos(turn)));
      const int y = static_cast<int>(std::lround(centre.y() + share * radius * std::sin(turn)));
      if (x >= 0 && y >= 0 && x < small.grey.cols && y < small.grey.rows)
        out.push_back(small.grey.at<std::uint8_t>(y, x));
    }
    return out;
  };
  const auto outside = ring(kLarger), inside = ring(kSmaller), within = ring(0.5);
  const auto enough = static_cast<std::size_t>(kLeastSeen * kDirections);
  if (outside.size() < enough || inside.size() < enough || within.size() < enough) return FieldSize::cannot_tell;
  const double bright = median_of(within);
  // What is around the field is as dark as the sensor gets; nothing else tells how dark that is once the field is
  // larger.
  constexpr double kDark = 16;
  if (bright < kDark + kLeastStep) return FieldSize::cannot_tell;
  const double between = kDark + kShareOfStep * (bright - kDark);
  if (median_of(outside) > between) return FieldSize::larger;
  if (median_of(inside) > between) return FieldSize::same;
  // A rim that the lamp hardly reaches is dark too: then only an edge tells.
  const auto found = round_field_in(small);
  if (!found) return FieldSize::cannot_tell;
  return found->radius_px < kSmaller * calibrated.radius_px ? FieldSize::smaller : FieldSize::same;
}

}  // namespace birdseye::calibration
