#include "calibration/detect/picture_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calibration/base/median.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kEdgeSmoothing_px = 1.5;  // so that noise makes no edges
constexpr int kTile_px = 16;
constexpr int kBorder_px = 3;
constexpr double kLeastSlope = 0.8;  // grey levels a pixel; below lies noise
constexpr double kLeastRise = 20;    // grey levels
constexpr int kMostWidth_px = 60;
constexpr double kLevel = 0.1;  // of the steepest slope: the edge's end. Uneven light goes on to rise
constexpr std::size_t kLevelOver_px = 4;
constexpr double kGaussianWidth = 2.5;  // rise over steepest slope of an edge blurred by 1 px

struct Slope {
  cv::Point at;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
};

Slope steepest_of_tile(const cv::Mat& smooth, int left, int top) {
  Slope steepest;
  for (int y = std::max(top, kBorder_px); y < std::min(top + kTile_px, smooth.rows - kBorder_px); ++y) {
    const float* row = smooth.ptr<float>(y);
    const float* above = smooth.ptr<float>(y - 1);
    const float* below = smooth.ptr<float>(y + 1);
    for (int x = std::max(left, kBorder_px); x < std::min(left + kTile_px, smooth.cols - kBorder_px); ++x) {
      const Eigen::Vector2d gradient(0.5 * (row[x + 1] - row[x - 1]), 0.5 * (below[x] - above[x]));
      if (gradient.squaredNorm() > steepest.gradient.squaredNorm()) steepest = {{x, y}, gradient};
    }
  }
  return steepest;
}

/// How far the grey goes on to rise (sign 1) or fall (-1) from an edge's middle, where it does so by `steepest` a
/// pixel.
double rise_along(const cv::Mat& smooth, const cv::Point& from, const Eigen::Vector2d& direction, double sign,
                  double steepest) {
  const double start = smooth.at<float>(from);
  double most = 0;
  std::vector<double> rises = {0};
  for (int t = 1; t < kMostWidth_px; ++t) {
    const cv::Point at(static_cast<int>(std::lround(from.x + t * direction.x())),
                       static_cast<int>(std::lround(from.y + t * direction.y())));
    if (at.x < 0 || at.y < 0 || at.x >= smooth.cols || at.y >= smooth.rows) break;
    const double rise = sign * (smooth.at<float>(at) - start);
    most = std::max(most, rise);
    rises.push_back(rise);
    if (rises.size() <= kLevelOver_px) continue;
    if (rise - rises[rises.size() - 1 - kLevelOver_px] < kLevel * static_cast<double>(kLevelOver_px) * steepest) break;
  }
  return most;
}

/// Steeper a little way off: the edge's middle lies in another tile.
bool is_flank(const cv::Mat& smooth, const Slope& slope) {
  const Eigen::Vector2d normal = slope.gradient.normalized();
  for (const double step_px : {-3.0, 3.0}) {
    const int x = static_cast<int>(std::lround(slope.at.x + step_px * normal.x()));
    const int y = static_cast<int>(std::lround(slope.at.y + step_px * normal.y()));
    if (x < 1 || y < 1 || x >= smooth.cols - 1 || y >= smooth.rows - 1) return true;
    const Eigen::Vector2d there(0.5 * (smooth.at<float>(y, x + 1) - smooth.at<float>(y, x - 1)),
                                0.5 * (smooth.at<float>(y + 1, x) - smooth.at<float>(y - 1, x)));
    if (std::abs(there.dot(normal)) > 1.02 * slope.gradient.norm()) return true;
  }
  return false;
}

/// Where the pattern is dark, in steps of its grid from its first point, and which of two colours a square has: both
/// colours of a chessboard are listed, for its counts alone do not always tell which is dark.
struct PatternPlace {
  Eigen::Vector2d at;
  int colour = 0;
};

std::vector<PatternPlace> places_of(const Pattern& pattern) {
  std::vector<PatternPlace> places;
  if (pattern.kind == PatternKind::dots) {
    for (const auto& mm : pattern_points_mm(pattern)) places.push_back({mm.head<2>() / pattern.spacing_mm, 0});
    return places;
  }
  const int less = pattern.kind == PatternKind::charuco ? 1 : 0;
  for (int row = 0; row + 1 < pattern.rows - less; ++row) {
    for (int column = 0; column + 1 < pattern.columns - less; ++column) {
      for (const auto& [dx, dy] : {std::pair{.5, .5}, {.25, .25}, {.75, .25}, {.25, .75}, {.75, .75}})
        places.push_back({{column + dx, row + dy}, (column + row) % 2});
    }
  }
  return places;
}

/// Of dots with every second row moved, the rows and columns of the lattice that holds them all.
std::vector<GridPoint> grid_of(const Pattern& pattern, const std::vector<int>& ids,
                               const std::vector<Eigen::Vector2d>& points_px) {
  const auto points_mm = pattern_points_mm(pattern);
  std::vector<GridPoint> points;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Eigen::Vector3d from_first = points_mm[static_cast<std::size_t>(ids[i])] - points_mm[0];
    const Eigen::Vector2d place = from_first.head<2>() / pattern.spacing_mm;
    points.push_back({ids[i], {std::lround(place.x()), std::lround(place.y())}, points_px[i]});
  }
  return points;
}

std::optional<Eigen::Vector2d> pixel_of(const std::vector<GridPoint>& points, const Eigen::Vector2d& place) {
  const Eigen::Vector2i near(static_cast<int>(std::floor(place.x())), static_cast<int>(std::floor(place.y())));
  const Eigen::Vector2d d = place - near.cast<double>();
  for (const int reach : {2, 3, 5, 8}) {  // farther where glare hid the neighbours
    const auto map = fit_local_map(points, near, reach, false);
    if (!map) continue;
    return map->a + map->jacobian * d +
           0.5 * (map->hxx * d.x() * d.x() + 2 * map->hxy * d.x() * d.y() + map->hyy * d.y() * d.y());
  }
  return std::nullopt;
}

}  // namespace

std::vector<EdgeWidth> edges_of_picture(const GreyView& picture) {
  const cv::Mat grey = mat_of(picture);
  cv::Mat smooth;
  grey.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, cv::Size(0, 0), kEdgeSmoothing_px);
  std::vector<EdgeWidth> edges;
  for (int top = 0; top < smooth.rows; top += kTile_px) {
    for (int left = 0; left < smooth.cols; left += kTile_px) {
      const Slope slope = steepest_of_tile(smooth, left, top);
      const double steepness = slope.gradient.norm();
      if (steepness < kLeastSlope || is_flank(smooth, slope)) continue;
      const Eigen::Vector2d normal = slope.gradient / steepness;
      const double rise =
          rise_along(smooth, slope.at, normal, 1, steepness) + rise_along(smooth, slope.at, -normal, -1, steepness);
      if (rise < kLeastRise) continue;
      const double width_px = rise / steepness;
      const double smoothing_px = kGaussianWidth * kEdgeSmoothing_px;
      edges.push_back({normal, std::sqrt(std::max(1.0, width_px * width_px - smoothing_px * smoothing_px))});
    }
  }
  return edges;
}

bool is_blurred(const GreyView& picture) {
  std::vector<double> widths;
  for (const EdgeWidth& edge : edges_of_picture(picture)) widths.push_back(edge.width_px);
  return median_of(widths) > kWidestEdge_px;
}

double local_contrast(const GreyView& picture) {
  constexpr int kWindow_px = 25;
  constexpr int kStep_px = 8;
  const cv::Mat grey = mat_of(picture);
  cv::Mat smooth;
  cv::GaussianBlur(grey, smooth, cv::Size(0, 0), kEdgeSmoothing_px);
  const cv::Mat window = cv::getStructuringElement(cv::MORPH_RECT, {kWindow_px, kWindow_px});
  cv::Mat contrast;
  cv::morphologyEx(smooth, contrast, cv::MORPH_GRADIENT, window);
  std::vector<std::uint8_t> differences;
  for (int y = 0; y < contrast.rows; y += kStep_px) {
    for (int x = 0; x < contrast.cols; x += kStep_px) differences.push_back(contrast.at<std::uint8_t>(y, x));
  }
  const auto most = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() * 9 / 10);
  std::nth_element(differences.begin(), most, differences.end());
  return *most;
}

double glare_of(const Pattern& pattern, const GreyView& picture, const std::vector<int>& ids,
                const std::vector<Eigen::Vector2d>& points_px) {
  const std::vector<GridPoint> points = grid_of(pattern, ids, points_px);
  if (points.size() < 6) return 0;
  std::vector<cv::Point2f> outline;
  for (const GridPoint& point : points) {
    const Eigen::Vector2f px = point.px.cast<float>();
    outline.emplace_back(px.x(), px.y());
  }
  cv::convexHull(std::vector<cv::Point2f>(outline), outline);
  std::array<std::vector<double>, 2> greys;
  for (const PatternPlace& place : places_of(pattern)) {
    const auto px = pixel_of(points, place.at);
    if (!px || !px->allFinite() || !inside(picture, *px, 1)) continue;
    const cv::Point2f at(static_cast<float>(px->x()), static_cast<float>(px->y()));
    if (cv::pointPolygonTest(outline, at, true) < -1) continue;
    greys[static_cast<std::size_t>(place.colour)].push_back(grey_at(picture, *px));
  }
  const bool second = !greys[1].empty() && median_of(greys[1]) < median_of(greys[0]);
  const std::vector<double>& dark = greys[second ? 1 : 0];
  if (dark.empty()) return 0;
  const auto saturated = std::count_if(dark.begin(), dark.end(), [](double grey) { return grey >= kSaturated; });
  return static_cast<double>(saturated) / static_cast<double>(dark.size());
}

}  // namespace birdseye::calibration
