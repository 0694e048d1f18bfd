#include "host/registration/rigid/points_in_ct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/volume/patient_box.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr double kBeyond_mm = 5;  // a marker that the border of the CT cuts
constexpr double kNear_mm = 20;   // of a lung's vessels, and of a pointer's tip from the skin
constexpr std::int16_t kAir_hu = -700;

bool is_in_air(const Volume& ct, const Vector3d& place_mm) {
  const Vector3d centre = ct.patient_from_voxel.inverse() * place_mm;
  std::array<int, 3> low{}, high{}, step{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double reach = kNear_mm / ct.spacing_mm[k];
    low[axis] = std::clamp(static_cast<int>(std::floor(centre[k] - reach)), 0, ct.size[axis] - 1);
    high[axis] = std::clamp(static_cast<int>(std::ceil(centre[k] + reach)), 0, ct.size[axis] - 1);
    step[axis] = std::max(1, static_cast<int>(2 / ct.spacing_mm[k]));  // mm: no body is thinner
  }
  for (int k = low[2]; k <= high[2]; k += step[2]) {
    for (int j = low[1]; j <= high[1]; j += step[1]) {
      for (int i = low[0]; i <= high[0]; i += step[0]) {
        const Vector3d offset = ct.spacing_mm.cwiseProduct(Vector3d(i, j, k) - centre);
        if (offset.norm() <= kNear_mm && ct.at(i, j, k) >= kAir_hu) return false;
      }
    }
  }
  return true;
}

}  // namespace

std::vector<std::size_t> points_outside(const Volume& ct, std::span<const Vector3d> points_mm) {
  const PatientBox box = patient_box(ct);
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const Vector3d& p = points_mm[i];
    const bool within =
        ((p - box.low_mm).array() >= -kBeyond_mm).all() && ((box.high_mm - p).array() >= -kBeyond_mm).all();
    if (!within || is_in_air(ct, p)) out.push_back(i);
  }
  return out;
}

bool look_like_ras(const Volume& ct, std::span<const Vector3d> points_mm) {
  if (points_mm.empty() || points_outside(ct, points_mm).empty()) return false;
  std::vector<Vector3d> turned_mm(points_mm.begin(), points_mm.end());
  for (Vector3d& point : turned_mm) point.head<2>() *= -1;
  return points_outside(ct, turned_mm).empty();
}

std::string reach_of(const Volume& ct) {
  const auto [low, high] = patient_box(ct);
  return fmt::format("x from {:.0f} to {:.0f}, y from {:.0f} to {:.0f}, z from {:.0f} to {:.0f} mm", low.x(), high.x(),
                     low.y(), high.y(), low.z(), high.z());
}

}  // namespace birdseye::host
