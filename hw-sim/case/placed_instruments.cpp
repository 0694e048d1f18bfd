#include "hw-sim/case/placed_instruments.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "calibration/base/units.hpp"
#include "hw-sim/case/draw.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kRadiusMm = 2.5;

/// A shaft from its tip outwards: rings about its axis, closed at the tip.
void add_shaft(Mesh& mesh, const Vector3d& tip, const Vector3d& outwards) {
  constexpr std::uint32_t kSides = 24;
  constexpr double kLengthMm = 300;
  // Along the shaft, and across it: a blunt tip, a jaw, the shaft.
  constexpr std::array<std::pair<double, double>, 5> kProfile = {
      {{0, 0.05}, {0.5, 0.9}, {12, 1.9}, {14, kRadiusMm}, {kLengthMm, kRadiusMm}}};
  const Vector3d x = outwards.unitOrthogonal();
  const Vector3d y = outwards.cross(x);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& [along_mm, radius_mm] : kProfile) {
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const double turn = 2 * std::numbers::pi * i / kSides;
      const Vector3d p = tip + along_mm * outwards + radius_mm * (std::cos(turn) * x + std::sin(turn) * y);
      mesh.vertices.emplace_back(p.cast<float>());
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < kProfile.size(); ++ring) {
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t a = first + ring * kSides + i;
      const std::uint32_t b = first + ring * kSides + (i + 1) % kSides;
      mesh.triangles.push_back({a, b, b + kSides});
      mesh.triangles.push_back({a, b + kSides, a + kSides});
    }
  }
}

/// Whether a shaft keeps clear of all of the organ's vertices.
bool is_clear(const Mesh& organ, const Vector3d& tip, const Vector3d& outwards) {
  constexpr double kClearMm = kRadiusMm + 1;
  return std::none_of(organ.vertices.begin(), organ.vertices.end(), [&](const Eigen::Vector3f& v) {
    const Vector3d from = v.cast<double>() - tip;
    const double along = std::max(0.0, from.dot(outwards));
    return (from - along * outwards).norm() < kClearMm;
  });
}

}  // namespace

Result<Mesh> place_instruments(const Mesh& organ, const Vector3d& towards_scope, int count, std::uint64_t seed) {
  constexpr int kTries = 2000;
  constexpr double kNearMiddle_mm = 45;
  const auto [low, high] = bounds(organ);
  const Vector3d middle = 0.5 * (low + high);
  Draw draw(seed + 91);
  Mesh mesh;
  int placed = 0;
  for (int i = 0; i < kTries && placed < count; ++i) {
    const std::size_t v = draw.index(organ.vertices.size());
    const Vector3d place = organ.vertices[v].cast<double>();
    const Vector3d normal = organ.normals[v].cast<double>();
    const Vector3d tip = place + draw.uniform(4, 12) * normal;
    // Flatter than any view, so that no lens stands in its way.
    const double tilt = draw.uniform(50, 65) * kRadPerDeg;
    const Vector3d aside = towards_scope.cross(draw.direction()).normalized();
    const Vector3d outwards = std::cos(tilt) * towards_scope + std::sin(tilt) * aside;
    const Vector3d across = place - middle - (place - middle).dot(towards_scope) * towards_scope;
    if (normal.dot(towards_scope) < 0.5 || across.norm() > kNearMiddle_mm || !is_clear(organ, tip, outwards)) continue;
    add_shaft(mesh, tip, outwards);
    ++placed;
  }
  if (placed < count) {
    return Error{Errc::degenerate, fmt::format("--instruments {}: only {} find a way to the organ; give fewer, or "
                                               "another --seed",
                                               count, placed)};
  }
  compute_normals(mesh);
  return mesh;
}

}  // namespace birdseye::hw_sim
