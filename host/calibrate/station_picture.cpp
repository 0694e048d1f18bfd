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
constexpr int kAlong = 1, kAway = 2;  ///< axes of the board's frame

const char* colour_of(const StationMark& s) {
  return s.odd ? kRed : kBlue;
}

/// An odd station's, to be found again in the table; of all where there are few.
std::string name_svg(const StationMark& s, std::size_t of, double x, double y) {
  constexpr std::size_t kFew = 20;
  if (s.name.empty() || of > (s.odd ? 3 * kFew : kFew)) return {};
  return svg_text(x + 6, y + 14, s.name, Anchor::start, s.odd ? kRed : kGrey);
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
    out += mark(at.x(), at.y(), up, size_for(stations), colour_of(s)) + name_svg(s, stations.size(), at.x(), at.y());
  }
  return out;
}

/// Where cameras are, board's frame, mm, z away from it on whichever side they are; and what they look along.
struct Place {
  Eigen::Vector3d at_mm, sight;
};

Place place_of(const StationMark& s) {
  Place out{s.camera_from_marker.inverse().translation(), s.camera_from_marker.rotation().transpose().col(2)};
  const double side = out.at_mm.z() > 0 ? 1 : -1;
  out.at_mm.z() *= side;
  out.sight.z() *= side;
  return out;
}

/// Across the board (x) and, up, along another axis of its frame.
std::string places(const std::vector<StationMark>& stations, int up, double left) {
  constexpr double kTop = 34, kSide = 310;
  Range across, upwards;
  for (const StationMark& s : stations) {
    const Eigen::Vector3d at_mm = place_of(s).at_mm;
    across.include(at_mm.x());
    upwards.include(at_mm[up]);
  }
  if (up == kAway) upwards.include(0);
  const double side_mm = 1.2 * std::max({upwards.size(), across.size(), 1.0});
  const double middle_mm = 0.5 * (across.low + across.high), height_mm = 0.5 * (upwards.low + upwards.high);
  const Range vertical = up == kAway ? Range{0, side_mm} : Range{height_mm - side_mm / 2, height_mm + side_mm / 2};
  const Axes axes({left + Axes::kLeft, kTop, kSide, kSide},
                  {{middle_mm - side_mm / 2, middle_mm + side_mm / 2}, "along the board's x, mm"},
                  {vertical, up == kAway ? "away from the board, mm" : "along the board's y, mm"});
  std::string out = svg_text(left + Axes::kLeft + kSide / 2, 16,
                             up == kAway ? "places of the camera, from the side" : "places of the camera, from above",
                             Anchor::middle) +
                    axes.svg();
  if (up == kAway)
    out +=
        svg_line(left + Axes::kLeft, kTop + kSide, left + Axes::kLeft + kSide, kTop + kSide, kGrey, "stroke-width='3'");
  for (const StationMark& s : stations) {
    const Place place = place_of(s);
    const double x = axes.x_of(place.at_mm.x()), y = axes.y_of(place.at_mm[up]);
    out += mark(x, y, Eigen::Vector2d(place.sight.x(), -place.sight[up]), size_for(stations), colour_of(s)) +
           name_svg(s, stations.size(), x, y);
  }
  return out;
}

}  // namespace

std::string station_picture_svg(const std::vector<StationMark>& stations) {
  if (stations.empty()) return {};
  return svg_picture(3 * kSize, kSize,
                     directions(stations) + places(stations, kAway, kSize) + places(stations, kAlong, 2 * kSize));
}

}  // namespace birdseye::host
