#include "tests/support/textured_scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace birdseye::testing {

namespace {

constexpr double kThing_mm = 45, kRoom_mm = 130;  // radii

/// Of the corners of cells, 0 to 1, scrambled.
double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
  auto bits = static_cast<std::uint64_t>(x * 73856093) ^ static_cast<std::uint64_t>(y * 19349663) ^
              static_cast<std::uint64_t>(z * 83492791);
  bits *= 0x9E3779B97F4A7C15ULL;
  bits ^= bits >> 32U;
  bits *= 0xD6E8FEB86659FD93ULL;
  bits ^= bits >> 32U;
  return static_cast<double>(bits & 0xFFFFU) / 65535.0;
}

/// Value noise: smooth between the corners of cells of so many mm.
double noise(const Eigen::Vector3d& at_mm, double cell_mm) {
  const Eigen::Vector3d at = at_mm / cell_mm;
  const Eigen::Vector3d floor = at.array().floor();
  const Eigen::Vector3d within = at - floor;
  const Eigen::Vector3d ease = within.array().square() * (3 - 2 * within.array());
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Eigen::Vector3i of = floor.cast<int>();
    for (int axis = 0; axis < 3; ++axis) {
      const bool far = ((corner >> axis) & 1) != 0;
      weight *= far ? ease[axis] : 1 - ease[axis];
      of[axis] += far ? 1 : 0;
    }
    sum += weight * lattice(of.x(), of.y(), of.z());
  }
  return sum;
}

/// Along a ray of length 1 to a sphere, seen from outside or from within; empty: it is missed.
std::optional<double> reach(const Eigen::Vector3d& from, const Eigen::Vector3d& along, const Eigen::Vector3d& middle,
                            double radius, bool within) {
  const Eigen::Vector3d to = middle - from;
  const double ahead = to.dot(along);
  const double squared = radius * radius - (to.squaredNorm() - ahead * ahead);
  if (squared < 0) return std::nullopt;
  const double at = within ? ahead + std::sqrt(squared) : ahead - std::sqrt(squared);
  return at > 0 ? std::optional(at) : std::nullopt;
}

}  // namespace

std::vector<std::uint8_t> TexturedScene::picture(const CameraModel& camera,
                                                 const Transform<Camera, Patient>& camera_from_patient,
                                                 const Eigen::Vector3d& moved_mm) {
  if (!(camera == camera_)) {
    camera_ = camera;
    rays_.clear();
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const auto ray = unproject(camera, Eigen::Vector2d(x, y));
        const bool seen = ray && (field_ == 0 || ray->head<2>().norm() < field_);
        rays_.push_back(seen ? ray->normalized() : Eigen::Vector3d::Zero());
      }
    }
  }
  const Transform<Patient, Camera> back = camera_from_patient.inverse();
  const Eigen::Vector3d from = back.translation();
  const Eigen::Vector3d thing_mm = middle_mm_ + moved_mm;
  std::vector<std::uint8_t> out(3 * rays_.size(), 0);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (rays_[i].isZero()) continue;
    const Eigen::Vector3d along = back.rotation() * rays_[i];
    auto thing = reach(from, along, thing_mm, kThing_mm, false);
    if (thing && halved_ && (from + *thing * along - thing_mm).x() > 0) thing.reset();
    const auto room = thing ? std::nullopt : reach(from, along, middle_mm_, kRoom_mm, true);
    if (!thing && !room) continue;
    const Eigen::Vector3d at = from + (thing ? *thing : *room) * along - (thing ? thing_mm : middle_mm_);
    const double light = 60 + 90 * noise(at, 9) + 70 * noise(at + Eigen::Vector3d(100, 0, 0), 4);
    out[3 * i] = static_cast<std::uint8_t>(std::clamp(light, 0.0, 255.0));
    out[3 * i + 1] = out[3 * i + 2] = static_cast<std::uint8_t>(std::clamp(0.6 * light, 0.0, 255.0));
  }
  return out;
}

}  // namespace birdseye::testing
