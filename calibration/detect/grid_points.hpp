#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/detect/detect.hpp"
#include "calibration/detect/pattern.hpp"

namespace birdseye::calibration {

/// Where an edge of the pattern was crossed in the picture: across it, and over how many pixels it rises.
struct EdgeWidth {
  Eigen::Vector2d normal;  ///< unit length
  double width_px = 0;
};

/// What the search for one kind of pattern hands on.
struct FoundPattern {
  std::vector<int> ids;
  std::vector<Eigen::Vector2d> points_px;
  std::vector<EdgeWidth> edges;
  double contrast = 0;  ///< grey levels
  double glare = 0;     ///< share of the dark places seen that are saturated
  std::string failure;  ///< why the points will not do; empty where they do
  LayoutEvidence layout;
  InsetEvidence inset;
};

FoundPattern find_chessboard(const Pattern& pattern, const GreyView& picture, Search search);
FoundPattern find_charuco(const Pattern& pattern, const GreyView& picture, Search search);
FoundPattern find_dots(const Pattern& pattern, const GreyView& picture);

/// A point of a grid: its whole-numbered place and its pixel.
struct GridPoint {
  int id = 0;
  Eigen::Vector2i place;
  Eigen::Vector2d px;
};

/// A smooth map place -> pixel around one point: px(place + d) = a + J d + 1/2 (hxx dx^2 + 2 hxy dx dy + hyy dy^2).
struct LocalMap {
  Eigen::Vector2d a;
  Eigen::Matrix2d jacobian;
  Eigen::Vector2d hxx, hxy, hyy;
};

/// The map fitted to the points within `reach` steps of `place`; the point at `place` itself is left out if told. Needs
/// six points; below ten the map has no curvature. Empty where the points do not determine the map.
std::optional<LocalMap> fit_local_map(const std::vector<GridPoint>& points, const Eigen::Vector2i& place, int reach,
                                      bool without_itself);

/// Removes points, worst first, that lie more than allowed_px(px per step) from where their neighbours put them.
void drop_strays(std::vector<GridPoint>& points, const std::function<double(double)>& allowed_px);

/// How far the columns run to the picture's right, 1 to -1: to choose among several ways of numbering the same points.
double uprightness(const std::vector<GridPoint>& points);

/// Grey between pixels, bilinear. Beyond the border, the border's grey.
double grey_at(const GreyView& picture, const Eigen::Vector2d& px);
bool inside(const GreyView& picture, const Eigen::Vector2d& px, double margin_px);

/// From this on a pixel counts as saturated: JPEG and scaling keep 255 from being reached.
inline constexpr int kSaturated = 250;

}  // namespace birdseye::calibration
