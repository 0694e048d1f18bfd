#include "host/calibrate/lens_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/report/axes.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector2d;

constexpr double kLensWidth = 760;
constexpr int kLensLines = 12;   ///< across the picture; downwards as far apart
constexpr int kLineSteps = 120;  ///< of a line
constexpr int kEdgePlaces = 24;  ///< places along each side of the picture

/// What the picture shows, without distortion: normalised coordinates.
struct Shown {
  Range x, y;
  double most_px = 0;   ///< from where a lens without distortion would show a place to where it is shown
  bool folded = false;  ///< somewhere in the picture no ray comes in
};

Shown shown_by(const CameraModel& camera) {
  Shown out;
  for (int i = 0; i <= kEdgePlaces; ++i) {
    for (int j = 0; j <= kEdgePlaces; ++j) {
      const Vector2d pixel(camera.width_px * i / double{kEdgePlaces} - 0.5,
                           camera.height_px * j / double{kEdgePlaces} - 0.5);
      const auto ray = unproject(camera, pixel);
      out.folded |= !ray;
      if (!ray) continue;
      out.x.include(ray->x());
      out.y.include(ray->y());
      const Vector2d straight(camera.cx_px + camera.fx_px * ray->x(), camera.cy_px + camera.fy_px * ray->y());
      out.most_px = std::max(out.most_px, (pixel - straight).norm());
    }
  }
  return out;
}

/// Where a direction is shown; empty where the lens folds.
std::optional<Vector2d> pixel_of(const CameraModel& camera, const Vector2d& undistorted) {
  constexpr double kSame = 1e-6;
  const Vector2d distorted = distort(camera, undistorted);
  const auto back = undistort(camera, distorted);
  if (!back || !((*back - undistorted).norm() < kSame)) return std::nullopt;
  return Vector2d(camera.cx_px + camera.fx_px * distorted.x(), camera.cy_px + camera.fy_px * distorted.y());
}

std::string line_svg(const CameraModel& camera, const Vector2d& from, const Vector2d& to, double scale) {
  std::string out, points;
  const auto end_line = [&] {
    if (!points.empty()) out += fmt::format("<polyline points='{}' fill='none' stroke='{}'/>", points, kBlue);
    points.clear();
  };
  for (int i = 0; i <= kLineSteps; ++i) {
    const auto pixel = pixel_of(camera, from + (to - from) * i / kLineSteps);
    if (!pixel) {
      end_line();
      continue;
    }
    points += fmt::format("{:.1f},{:.1f} ", scale * (pixel->x() + 0.5), scale * (pixel->y() + 0.5));
  }
  end_line();
  return out;
}

}  // namespace

std::string lens_picture_svg(const CameraModel& camera) {
  constexpr double kFoot = 26, kArm = 8;
  const double scale = kLensWidth / camera.width_px, height = scale * camera.height_px;
  const Shown shown = shown_by(camera);
  std::string svg = fmt::format(
      "<svg width='{0}' height='{2:.1f}'>"
      "<rect x='0.5' y='0.5' width='{1}' height='{3:.1f}' fill='#f7f8fa' stroke='#999'/>",
      kLensWidth, kLensWidth - 1, height, height - 1);
  if (shown.x.size() > 0 && shown.y.size() > 0) {
    const double apart = shown.x.size() / kLensLines;
    const int down = static_cast<int>(std::ceil(shown.y.size() / apart));
    for (int i = 0; i <= kLensLines; ++i) {
      const double x = shown.x.low + i * apart;
      svg += line_svg(camera, {x, shown.y.low}, {x, shown.y.high}, scale);
    }
    for (int j = 0; j <= down; ++j) {
      const double y = std::min(shown.y.low + j * apart, shown.y.high);
      svg += line_svg(camera, {shown.x.low, y}, {shown.x.high, y}, scale);
    }
  }
  const double x = scale * (camera.cx_px + 0.5), y = scale * (camera.cy_px + 0.5);
  svg += svg_line(x - kArm, y, x + kArm, y, kOrange, "stroke-width='2.5'") +
         svg_line(x, y - kArm, x, y + kArm, kOrange, "stroke-width='2.5'") + "</svg>";
  svg += svg_text(
      8, height + 18,
      fmt::format("moves what it shows by up to {:.3g} px; cross: the centre, at ({:.0f}, {:.0f}) px{}", shown.most_px,
                  camera.cx_px, camera.cy_px, shown.folded ? "; folds where lines end inside the picture" : ""));
  return svg_picture(kLensWidth, height + kFoot, svg);
}

}  // namespace birdseye::host
