#include "host/volume/marker_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace birdseye::host {

namespace {

/// A ring's round section: its radius, and that of the circle its centre runs on.
struct Tube {
  double radius_mm, around_mm;
};
Tube tube_of(const MarkerShape& s) {
  return {(s.diameter_mm - s.hole_mm) / 4, (s.diameter_mm + s.hole_mm) / 4};
}

}  // namespace

const char* name_of(MarkerKind kind) {
  constexpr std::array<const char*, 4> kNames{"ball", "ring", "cylinder", "post"};
  return kNames[static_cast<std::size_t>(kind)];
}

double MarkerShape::outside_mm(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& axis) const {
  if (kind == MarkerKind::ball || kind == MarkerKind::post) return point_mm.norm() - diameter_mm / 2;
  const double along = point_mm.dot(axis);
  const double from_axis = (point_mm - along * axis).norm();
  if (kind == MarkerKind::ring) {
    const Tube tube = tube_of(*this);
    return std::hypot(from_axis - tube.around_mm, along) - tube.radius_mm;
  }
  // The wall's section is a rectangle.
  const double across = std::abs(from_axis - (diameter_mm + hole_mm) / 4) - (diameter_mm - hole_mm) / 4;
  const double above = std::abs(along) - height_mm / 2;
  return std::hypot(std::max(across, 0.0), std::max(above, 0.0)) + std::min(0.0, std::max(across, above));
}

double MarkerShape::half_extent_mm(const Eigen::Vector3d& direction, const Eigen::Vector3d& axis) const {
  const double along = std::abs(direction.dot(axis));
  const double across = std::sqrt(std::max(0.0, 1 - along * along));
  switch (kind) {
    case MarkerKind::ball:
    case MarkerKind::post:
      return diameter_mm / 2;
    case MarkerKind::ring:
      return tube_of(*this).around_mm * across + tube_of(*this).radius_mm;
    case MarkerKind::cylinder:
      break;
  }
  return diameter_mm / 2 * across + height_mm / 2 * along;
}

double MarkerShape::volume_mm3() const {
  constexpr double kPi = std::numbers::pi;
  switch (kind) {
    case MarkerKind::ball:
    case MarkerKind::post:
      return kPi / 6 * std::pow(diameter_mm, 3);
    case MarkerKind::ring:
      return 2 * kPi * kPi * tube_of(*this).around_mm * std::pow(tube_of(*this).radius_mm, 2);
    case MarkerKind::cylinder:
      break;
  }
  return kPi / 4 * (diameter_mm * diameter_mm - hole_mm * hole_mm) * height_mm;
}

double MarkerShape::thinnest_mm() const {
  switch (kind) {
    case MarkerKind::ball:
    case MarkerKind::post:
      return diameter_mm;
    case MarkerKind::ring:
      return 2 * tube_of(*this).radius_mm;
    case MarkerKind::cylinder:
      break;
  }
  return std::min(diameter_mm, height_mm);
}

double MarkerShape::widest_mm() const {
  return kind == MarkerKind::cylinder ? std::hypot(diameter_mm, height_mm) : diameter_mm;
}

Result<void> check(const MarkerShape& s) {
  constexpr double kMost_mm = 100;
  const bool hollow = s.kind == MarkerKind::ring || s.kind == MarkerKind::cylinder;
  if (s.kind == MarkerKind::post && s.diameter_mm == 0) return {};  // of any size
  if (!(s.diameter_mm > 0) || s.diameter_mm > kMost_mm)
    return Error{Errc::bad_value,
                 fmt::format("a marker {} mm across: give its outer diameter in mm (--diameter)", s.diameter_mm)};
  if (hollow && !(s.hole_mm > 0 && s.hole_mm < s.diameter_mm)) {
    return Error{Errc::bad_value,
                 fmt::format("a hole of {} mm in a marker {} mm across: give the hole's diameter in mm", s.hole_mm,
                             s.diameter_mm)};
  }
  if (s.kind == MarkerKind::cylinder && !(s.height_mm > 0 && s.height_mm <= kMost_mm))
    return Error{Errc::bad_value, fmt::format("a cylinder {} mm high: give its height in mm", s.height_mm)};
  return {};
}

}  // namespace birdseye::host
