#include "host/calibrate/station_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "host/report/axes.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

constexpr double kSize = 400, kMiddle = kSize / 2, kReach = 165;
const char* colour_of(const StationMark& s) {
  return s.odd ? kRed : kBlue;
}

double size_for(const std::vector<StationMark>& stations) {
  constexpr std::size_t kMany = 60;
  return stations.size() > kMany ? 0.4 : 1;
}

/// along: of a length of about one. size: 1 where there is room for it.
std::string mark(double x, double y, const Eigen::Vector2d& along, double size, const char* colour) {
  const Eigen::Vector2d tick = 15 * size * along;
  return svg_line(x, y, x + tick.x(), y + tick.y(), colour, size < 1 ? "" : "stroke-width='1.5'") +
         svg_dot(x, y, 4 * size, colour);
}

/// Tilt from the board's normal and direction of it, by the line of sight.
std::string directions(const std::vector<StationMark>& stations) {
  double steepest = 30;
  const auto sight = [](const StationMark& s) {
    return Eigen::Vector3d(s.camera_from_marker.rotation().transpose().col(2));
  };
  const auto tilt_deg = [](const Eigen::Vector3d& d) {
    return std::atan2(d.head<2>().norm(), std::abs(d.z())) * kDegPerRad;
  };
  for (const StationMark& s : stations) steepest = std::max(steepest, tilt_deg(sight(s)));
  const double outer = 15 * std::ceil(steepest / 15);
  std::string out = svg_text(kMiddle, 16, "lines of sight: tilt, direction, roll", Anchor::middle) +
                    svg_line(kMiddle, kMiddle - kReach, kMiddle, kMiddle + kReach, kFaint) +
                    svg_line(kMiddle - kReach, kMiddle, kMiddle + kReach, kMiddle, kFaint) +
                    rings_svg(kMiddle, kMiddle, kReach, outer, 15);
  for (const StationMark& s : stations) {
    // Towards the camera, so that the mark lies on the side that the scope stood on.
    const Eigen::Vector3d d = sight(s) * (sight(s).z() > 0 ? -1 : 1);
    const Eigen::Vector2d way =
        d.head<2>().norm() > 1e-9 ? Eigen::Vector2d(d.head<2>().normalized()) : Eigen::Vector2d(0, 0);
    const Eigen::Vector2d at = Eigen::Vector2d::Constant(kMiddle) + kReach * tilt_deg(d) / outer * way;
    const Eigen::Vector2d up = -s.camera_from_marker.rotation().transpose().col(1).head<2>().normalized();
    out += mark(at.x(), at.y(), up, size_for(stations), colour_of(s));
  }
  return out;
}

/// Across the board (x) and away from it, in mm.
std::string places(const std::vector<StationMark>& stations) {
  constexpr double kTop = 34, kSide = 310;
  double far = 1;
  Range across;
  for (const StationMark& s : stations) {
    const Eigen::Vector3d at = s.camera_from_marker.inverse().translation();
    far = std::max(far, std::abs(at.z()));
    across.include(at.x());
  }
  const double side_mm = 1.1 * std::max(far, across.size()), middle_mm = 0.5 * (across.low + across.high);
  const Axes axes({kSize + Axes::kLeft, kTop, kSide, kSide},
                  {{middle_mm - side_mm / 2, middle_mm + side_mm / 2}, "across the board, mm"},
                  {{0, side_mm}, "above the board, mm"});
  std::string out =
      svg_text(kSize + Axes::kLeft + kSide / 2, 16, "places of the camera, from the side", Anchor::middle) +
      axes.svg() +
      svg_line(kSize + Axes::kLeft, kTop + kSide, kSize + Axes::kLeft + kSide, kTop + kSide, kGrey, "stroke-width='3'");
  for (const StationMark& s : stations) {
    const Eigen::Vector3d at = s.camera_from_marker.inverse().translation();
    const Eigen::Vector3d sight = s.camera_from_marker.rotation().transpose().col(2);
    const double side = at.z() > 0 ? 1 : -1;
    out += mark(axes.x_of(at.x()), axes.y_of(std::abs(at.z())), Eigen::Vector2d(sight.x(), -side * sight.z()),
                size_for(stations), colour_of(s));
  }
  return out;
}

}  // namespace

std::string station_picture_svg(const std::vector<StationMark>& stations) {
  if (stations.empty()) return {};
  return svg_picture(2 * kSize, kSize, directions(stations) + places(stations));
}

}  // namespace birdseye::host
