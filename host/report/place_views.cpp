#include "host/report/place_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/report/axes.hpp"

namespace birdseye::host {

namespace {

constexpr double kSide = 250, kBetween = 8, kTop = 10, kPanel = Axes::kLeft + kSide + kBetween;

/// The middle of the places, and half of the side of a cube that holds them.
struct Cube {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  double half_mm = 1;
};

Cube cube_of(const std::vector<PlaceMark>& marks) {
  std::array<Range, 3> ranges;
  for (const PlaceMark& mark : marks) {
    for (int axis = 0; axis < 3; ++axis) ranges[static_cast<std::size_t>(axis)].include(mark.place_mm[axis]);
  }
  Cube cube;
  double widest_mm = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Range& range = ranges[static_cast<std::size_t>(axis)];
    if (!(range.high >= range.low)) return cube;
    cube.middle_mm[axis] = 0.5 * (range.low + range.high);
    widest_mm = std::max(widest_mm, range.size());
  }
  constexpr double kMargin = 0.62;  // room for names and arrows; half would be none
  if (widest_mm > 0) cube.half_mm = kMargin * widest_mm;
  return cube;
}

std::string shape_svg(const PlaceMark& mark, double x, double y) {
  constexpr double kDot = 3, kArm = 4;
  switch (mark.shape) {
    case PlaceShape::dot:
      return svg_dot(x, y, kDot, mark.colour);
    case PlaceShape::ring:
      return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='none' stroke='{}' stroke-width='1.5'/>", x, y,
                         kArm, mark.colour);
    case PlaceShape::cross:
      return svg_line(x - kArm, y - kArm, x + kArm, y + kArm, mark.colour, "stroke-width='1.8'") +
             svg_line(x - kArm, y + kArm, x + kArm, y - kArm, mark.colour, "stroke-width='1.8'");
  }
  return {};
}

/// Cut off where it leaves the panel.
std::string sphere_svg(double radius_mm, const Axes& axes) {
  if (!(radius_mm > 0)) return {};
  const PlotArea& area = axes.area();
  const double x = area.left, y = area.top, radius = axes.x_of(radius_mm) - axes.x_of(0);
  return fmt::format(
      "<svg x='{0:.1f}' y='{1:.1f}' width='{2}' height='{3}'><circle cx='{4:.1f}' cy='{5:.1f}' r='{6:.1f}' fill='none' "
      "stroke='{7}' {8}/></svg>",
      x, y, area.width, area.height, axes.x_of(0) - x, axes.y_of(0) - y, radius, kGrey, kDashed);
}

}  // namespace

double arrow_times(const std::vector<PlaceMark>& marks) {
  constexpr double kShare = 1.0 / 6;
  double longest_mm = 0;
  for (const PlaceMark& mark : marks) {
    if (mark.shift_mm.allFinite()) longest_mm = std::max(longest_mm, mark.shift_mm.norm());
  }
  if (longest_mm <= 0) return 1;
  return std::max(1.0, round_down(kShare * 2 * cube_of(marks).half_mm / longest_mm));
}

std::string place_views_svg(const PlaceViews& views, double times) {
  const Cube cube = cube_of(views.marks);
  constexpr std::array<std::array<int, 2>, 3> kPlanes{{{0, 1}, {0, 2}, {1, 2}}};
  std::string svg;
  for (std::size_t n = 0; n < kPlanes.size(); ++n) {
    const int across = kPlanes[n][0], up = kPlanes[n][1];
    const auto axis = [&](int which) {
      return Axis{{cube.middle_mm[which] - cube.half_mm, cube.middle_mm[which] + cube.half_mm},
                  views.axes[static_cast<std::size_t>(which)]};
    };
    const Axes axes({kPanel * static_cast<double>(n) + Axes::kLeft, kTop, kSide, kSide}, axis(across), axis(up));
    svg += axes.svg() + sphere_svg(views.radius_mm, axes);
    for (const PlaceMark& mark : views.marks) {
      if (!mark.place_mm.allFinite() || !mark.shift_mm.allFinite()) continue;
      const double x = axes.x_of(mark.place_mm[across]), y = axes.y_of(mark.place_mm[up]);
      const Eigen::Vector3d end_mm = mark.place_mm + times * mark.shift_mm;
      if (!mark.shift_mm.isZero(0)) svg += svg_arrow(x, y, axes.x_of(end_mm[across]), axes.y_of(end_mm[up]), kInk);
      svg += shape_svg(mark, x, y);
      if (!mark.name.empty()) svg += svg_text(x + 6, y - 5, mark.name, Anchor::start, mark.colour);
    }
  }
  return svg_picture(3 * kPanel, kTop + kSide + Axes::kBelow, svg);
}

}  // namespace birdseye::host
