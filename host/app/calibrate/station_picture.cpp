#include "host/app/calibrate/station_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"

namespace birdseye::host {

namespace {

constexpr double kSize = 400, kMiddle = kSize / 2, kReach = 165;
constexpr const char* kPlain = "#1f5fa8";
constexpr const char* kOdd = "#b3261e";

const char* colour_of(const StationMark& s) {
  return s.odd ? kOdd : kPlain;
}

std::string text_at(double x, double y, const std::string& text, const char* anchor = "middle") {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>", x, y, anchor, text);
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
  std::string out = text_at(kMiddle, 16, "lines of sight: tilt, direction, roll");
  for (int k = 1; 15 * k <= outer; ++k) {
    const double ring = 15 * k;
    out += fmt::format("<circle cx='{0}' cy='{0}' r='{1:.1f}' fill='none' stroke='#d5d9e0'/>", kMiddle,
                       kReach * ring / outer);
    out += text_at(kMiddle + 3, kMiddle - kReach * ring / outer - 2, fmt::format("{:.0f}\u00b0", ring), "start");
  }
  out +=
      fmt::format("<path d='M{0} {1}V{2}M{1} {0}H{2}' stroke='#e6e9ee'/>", kMiddle, kMiddle - kReach, kMiddle + kReach);
  for (const StationMark& s : stations) {
    // Towards the camera, so that the mark lies on the side that the scope stood on.
    const Eigen::Vector3d d = sight(s) * (sight(s).z() > 0 ? -1 : 1);
    const Eigen::Vector2d way =
        d.head<2>().norm() > 1e-9 ? Eigen::Vector2d(d.head<2>().normalized()) : Eigen::Vector2d(0, 0);
    const Eigen::Vector2d at = Eigen::Vector2d::Constant(kMiddle) + kReach * tilt_deg(d) / outer * way;
    const Eigen::Vector2d up = 13 * -s.camera_from_marker.rotation().transpose().col(1).head<2>().normalized();
    out += fmt::format("<path d='M{:.1f} {:.1f}l{:.1f} {:.1f}' stroke='{}' stroke-width='1.5'/>", at.x(), at.y(),
                       up.x(), up.y(), colour_of(s));
    out += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/>", at.x(), at.y(), colour_of(s));
  }
  return out;
}

/// Across the board (x) and away from it, in mm.
std::string places(const std::vector<StationMark>& stations) {
  double far = 1, left = 1e300, right = -1e300;
  for (const StationMark& s : stations) {
    const Eigen::Vector3d at = s.camera_from_marker.inverse().translation();
    far = std::max(far, std::abs(at.z()));
    left = std::min(left, at.x());
    right = std::max(right, at.x());
  }
  const double scale = 2 * kReach / std::max({far, right - left, 1.0});
  const double ground = kMiddle + kReach;
  std::string out = text_at(kSize + kMiddle, 16, "places of the camera, from the side (mm)");
  out += fmt::format("<path d='M{} {}H{}' stroke='#8a93a3' stroke-width='3'/>", kSize + 20, ground, 2 * kSize - 20);
  out += text_at(kSize + kMiddle, ground + 20, "plane of the board");
  double step = std::pow(10, std::floor(std::log10(far)));
  if (far / step < 3) step /= 2;
  for (int k = 1; k * step <= far * 1.001; ++k) {
    const double z = k * step;
    out += fmt::format("<path d='M{} {:.1f}H{}' stroke='#e6e9ee'/>", kSize + 45, ground - z * scale, 2 * kSize - 20);
    out += text_at(kSize + 40, ground - z * scale + 4, fmt::format("{:.0f}", z), "end");
  }
  for (const StationMark& s : stations) {
    const Eigen::Vector3d at = s.camera_from_marker.inverse().translation();
    const Eigen::Vector3d sight = s.camera_from_marker.rotation().transpose().col(2);
    const double side = at.z() > 0 ? 1 : -1;
    const double x = kSize + kMiddle + 10 + (at.x() - 0.5 * (left + right)) * scale;
    const double y = ground - std::abs(at.z()) * scale;
    out += fmt::format("<path d='M{:.1f} {:.1f}l{:.1f} {:.1f}' stroke='{}' stroke-width='1.5'/>", x, y, 16 * sight.x(),
                       -16 * side * sight.z(), colour_of(s));
    out += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/>", x, y, colour_of(s));
  }
  return out;
}

}  // namespace

std::string station_picture_svg(const std::vector<StationMark>& stations) {
  if (stations.empty()) return {};
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {:.0f} {:.0f}' width='{:.0f}' "
      "font-family='system-ui,sans-serif' font-size='12' fill='#445'>{}{}</svg>",
      2 * kSize, kSize, 2 * kSize, directions(stations), places(stations));
}

}  // namespace birdseye::host
