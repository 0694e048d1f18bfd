#include "calibration/detect/detect.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/detect/detect_inset.hpp"
#include "calibration/detect/grid_points.hpp"
#include "calibration/detect/picture_edges.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kLeastSide_px = 64;
constexpr int kUnlit = 40;              // what the brightest hundredth of a lit picture is above
constexpr double kMostSaturated = 0.6;  // of the whole picture: no board is that white
constexpr double kGlareShare = 0.02;    // of the picture, saturated: worth a word where nothing was found
constexpr double kMostGlare = 0.1;      // of the dark places: corners beside what shines are moved by its halo
constexpr double kLeastContrast = 15;   // grey levels; below, noise moves corners by tenths of a pixel
constexpr double kSoftEdge_px = 5;      // worth a word where nothing was found: tags do not read
constexpr double kMotionRatio = 1.6;    // edges this much wider one way than the other ..
constexpr double kAlike = 0.05;         // weight against an edge's
constexpr double kAcross = 0.85;        // cosine of 32 degrees
constexpr double kMoved_px = 5;         // .. and wider than a sharp picture's: it moved

/// Width of an edge by its normal n: width^2 = n' S n, an ellipse as blur by motion and by focus give.
void measure_sharpness(const std::vector<EdgeWidth>& edges, Detection& detection) {
  if (edges.size() < 8) return;
  detection.motion_deg.reset();
  std::vector<double> widths;
  widths.reserve(edges.size());
  for (const EdgeWidth& edge : edges) widths.push_back(edge.width_px);
  detection.sharpness_px = median_of(widths);
  const auto most = widths.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(widths.size()));
  std::nth_element(widths.begin(), most, widths.end());
  const double widest = *most;  // beyond it are shadows
  // Edges of a board run two ways: what their widths leave open, that they are alike all round has to say.
  const Eigen::Vector3d alike(1, 0, 1);
  const Eigen::Vector3d weight = kAlike * static_cast<double>(edges.size()) * Eigen::Vector3d(1, 2, 1);
  Eigen::Matrix3d normal_matrix = weight.asDiagonal();
  Eigen::Vector3d right = weight.asDiagonal() * alike * detection.sharpness_px * detection.sharpness_px;
  for (const EdgeWidth& edge : edges) {
    const Eigen::Vector2d& n = edge.normal;
    const Eigen::Vector3d row(n.x() * n.x(), 2 * n.x() * n.y(), n.y() * n.y());
    normal_matrix += row * row.transpose();
    right += row * std::pow(std::min(edge.width_px, widest), 2);
  }
  const Eigen::Vector3d s = normal_matrix.fullPivLu().solve(right);
  Eigen::Matrix2d ellipse;
  ellipse << s[0], s[1], s[1], s[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(ellipse);
  const double narrow = std::sqrt(std::max(axes.eigenvalues()[0], 1.0));
  const double wide = std::sqrt(std::max(axes.eigenvalues()[1], 1.0));
  if (wide < kMotionRatio * narrow || wide < kMoved_px) return;
  const Eigen::Vector2d along = axes.eigenvectors().col(1);
  detection.motion_deg = std::atan(along.y() / along.x()) * kDegPerRad;
  // The median is of edges along the motion, too, which stay sharp.
  widths.clear();
  for (const EdgeWidth& edge : edges) {
    if (std::abs(edge.normal.dot(along)) > kAcross) widths.push_back(edge.width_px);
  }
  detection.sharpness_px = std::max(detection.sharpness_px, median_of(widths));
}

std::string blurred(const Detection& detection) {
  std::string text = fmt::format("blurred: edges are {:.1f} px wide", detection.sharpness_px);
  if (detection.motion_deg) text += fmt::format("; it moved along {:.0f} degrees", *detection.motion_deg);
  return text;
}

std::string too_little_contrast(double contrast) {
  return fmt::format("light and dark of the pattern differ by {:.0f} grey levels only", contrast);
}

double area_share(const std::vector<Eigen::Vector2d>& points_px, const GreyView& picture) {
  std::vector<cv::Point2f> points;
  points.reserve(points_px.size());
  for (const Eigen::Vector2d& p : points_px) points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  if (points.size() < 3) return 0;
  std::vector<cv::Point2f> hull;
  cv::convexHull(points, hull);
  return cv::contourArea(hull) / (static_cast<double>(picture.width_px) * picture.height_px);
}

FoundPattern find(const Pattern& pattern, const GreyView& picture, Search search) {
  switch (pattern.kind) {
    case PatternKind::chessboard:
      return find_chessboard(pattern, picture, search);
    case PatternKind::charuco:
      return find_charuco(pattern, picture, search);
    case PatternKind::dots:
      return find_dots(pattern, picture);
  }
  return {};
}

/// How light the picture is.
struct Exposure {
  int brightest_hundredth = 255;
  double saturated = 0;
};
Exposure exposure_of(const GreyView& picture) {
  std::array<std::size_t, 256> counts{};
  for (int y = 0; y < picture.height_px; ++y) {
    const std::uint8_t* row = picture.row(y);
    for (int x = 0; x < picture.width_px; ++x) ++counts[row[x]];
  }
  const double all = static_cast<double>(picture.width_px) * picture.height_px;
  Exposure exposure;
  double above = 0;
  for (int grey = 255; grey >= 0; --grey) {
    above += static_cast<double>(counts[static_cast<std::size_t>(grey)]) / all;
    if (grey == kSaturated) exposure.saturated = above;
    if (above < 0.01) exposure.brightest_hundredth = std::max(0, grey - 1);
  }
  return exposure;
}

constexpr const char* kLessGlare = "tilt the board out of the light's reflection, or dim the light";

std::string why_rejected(const Detection& detection, const FoundPattern& found, const Exposure& exposure) {
  if (detection.sharpness_px > kWidestEdge_px) return blurred(detection);
  if (detection.glare > kMostGlare) {
    return fmt::format("glare: {:.0f} % of the pattern's dark places are saturated; {}", 100 * detection.glare,
                       kLessGlare);
  }
  if (!found.failure.empty()) {
    std::string text = found.failure;
    if (detection.contrast < kLeastContrast) text += "; " + too_little_contrast(detection.contrast);
    if (detection.sharpness_px > kSoftEdge_px)
      text += fmt::format("; edges are {:.1f} px wide: is it in focus?", detection.sharpness_px);
    if (exposure.saturated > kGlareShare)
      text += fmt::format("; glare: {:.0f} % of the picture is saturated; {}", 100 * exposure.saturated, kLessGlare);
    return text;
  }
  if (detection.contrast < kLeastContrast) return too_little_contrast(detection.contrast);
  return {};
}

}  // namespace

Detection detect(const Pattern& pattern, const GreyView& picture, const std::string& name, Search search) {
  Detection detection;
  const auto points_in_marker_mm = pattern_points_mm(pattern);
  detection.points_of_pattern = static_cast<int>(points_in_marker_mm.size());
  if (!picture.whole() || picture.width_px < kLeastSide_px || picture.height_px < kLeastSide_px) {
    detection.rejected = fmt::format("smaller than {} px", kLeastSide_px);
    return detection;
  }
  const Exposure exposure = exposure_of(picture);
  if (exposure.brightest_hundredth < kUnlit) {
    detection.rejected = fmt::format("too dark: hardly any of it is lighter than {} of 255; is the light on?",
                                     exposure.brightest_hundredth);
    return detection;
  }
  if (exposure.saturated > kMostSaturated) {
    detection.rejected = fmt::format("overexposed: {:.0f} % of it is saturated", 100 * exposure.saturated);
    return detection;
  }
  FoundPattern found = find(pattern, picture, search);
  detection.glare = std::max(found.glare, glare_of(pattern, picture, found.ids, found.points_px));
  if (pattern.inset_columns > 0) add_inset(pattern, picture, found);
  detection.points_seen = static_cast<int>(found.ids.size());
  detection.contrast = found.contrast;
  detection.layout = found.layout;
  detection.inset = found.inset;
  detection.area_share = area_share(found.points_px, picture);
  measure_sharpness(found.edges, detection);
  // Where too little is found to tell, or edges are wider than corners are looked at, the whole picture says more.
  if (!found.failure.empty() || detection.sharpness_px > kSoftEdge_px)
    measure_sharpness(edges_of_picture(picture), detection);
  if (found.ids.empty()) detection.contrast = local_contrast(picture);
  detection.rejected = why_rejected(detection, found, exposure);
  if (!detection.rejected.empty()) return detection;
  PatternView view{name, found.ids, {}, found.points_px};
  for (const int id : found.ids) view.points_in_marker_mm.push_back(points_in_marker_mm[static_cast<std::size_t>(id)]);
  detection.view = std::move(view);
  return detection;
}

}  // namespace birdseye::calibration
