#include "hw-sim/case/viewpoints.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/base/units.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/camera/look_at.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

/// The place on the line from target along direction that is distance_mm from the nearest of the mesh's vertices.
Vector3d stand_off(const Mesh& mesh, const Vector3d& target, const Vector3d& direction, double distance_mm) {
  constexpr std::size_t kEvery = 7;
  constexpr int kFurthestMm = 700;
  Vector3d eye = target;
  for (int away_mm = kFurthestMm; away_mm > 0; --away_mm) {
    eye = target + away_mm * direction;
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < mesh.vertices.size(); i += kEvery) {
      nearest = std::min(nearest, (mesh.vertices[i].cast<double>() - eye).squaredNorm());
    }
    if (nearest < distance_mm * distance_mm) break;
  }
  return eye;
}

}  // namespace

std::vector<Transform<Camera, Patient>> choose_viewpoints(const Subject& subject, int count, double distance_mm,
                                                          std::uint64_t seed) {
  std::uint64_t draw = 0;
  const auto uniform = [&](double low, double high) { return low + (high - low) * hashed_uniform(seed + 71, draw++); };
  Vector3d middle = Vector3d::Zero();
  for (const Eigen::Vector3f& v : subject.surface.vertices) middle += v.cast<double>();
  middle /= static_cast<double>(subject.surface.vertices.size());

  const Vector3d& axis = subject.towards_scope;
  const Vector3d right = axis.cross(Vector3d::UnitZ()).normalized();
  const Vector3d up = right.cross(axis);
  std::vector<Transform<Camera, Patient>> views;
  for (int i = 0; i < count; ++i) {
    const double around = 2 * std::numbers::pi * (i + uniform(-0.2, 0.2)) / std::max(1, count - 1);
    const double tilt = (i == 0 ? uniform(0, 6) : uniform(24, 38)) * kRadPerDeg;
    const Vector3d direction =
        std::cos(tilt) * axis + std::sin(tilt) * (std::cos(around) * right + std::sin(around) * up);
    const Vector3d target = middle + uniform(-8, 8) * right + uniform(-8, 8) * up;
    const Vector3d eye = stand_off(subject.surface, target, direction, distance_mm * uniform(0.9, 1.1));
    views.push_back(look_at<Patient>(eye, target, -up, uniform(-12, 12) * kRadPerDeg).inverse());
  }
  return views;
}

}  // namespace birdseye::hw_sim
