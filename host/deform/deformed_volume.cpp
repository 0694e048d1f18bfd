#include "host/deform/deformed_volume.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr std::int16_t kAirHu = -1024;

std::int16_t value_at(const Volume& volume, const Eigen::Vector3d& voxel) {
  std::array<int, 3> base{};
  Eigen::Vector3d part;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.size[static_cast<std::size_t>(axis)] - 1;
    // What rounding moved out of the border voxel is still in it.
    constexpr double kSlack = 1e-6;
    if (!(voxel[axis] >= -kSlack && voxel[axis] <= last + kSlack)) return kAirHu;
    const double v = std::clamp(voxel[axis], 0.0, static_cast<double>(last));
    base[static_cast<std::size_t>(axis)] = std::min(static_cast<int>(v), std::max(0, last - 1));
    part[axis] = v - base[static_cast<std::size_t>(axis)];
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int bit[] = {c & 1, c >> 1 & 1, c >> 2};
    double w = 1;
    for (int axis = 0; axis < 3; ++axis) w *= bit[axis] != 0 ? part[axis] : 1 - part[axis];
    if (w > 0) sum += w * volume.at(base[0] + bit[0], base[1] + bit[1], base[2] + bit[2]);
  }
  return static_cast<std::int16_t>(std::lround(sum));
}

}  // namespace

Volume deformed_volume(const Volume& volume, const DisplacementField& field) {
  Volume out = volume;
  const Eigen::Affine3d voxel_from_patient = volume.patient_from_voxel.inverse();
  tbb::parallel_for(0, volume.size[2], [&](int k) {
    for (int j = 0; j < volume.size[1]; ++j) {
      for (int i = 0; i < volume.size[0]; ++i) {
        const Eigen::Vector3d p = volume.patient_from_voxel * Eigen::Vector3d(i, j, k);
        const Eigen::Vector3d u = field.displacement(p);
        if (u.isZero(0)) continue;
        out.hu[volume.index(i, j, k)] = value_at(volume, voxel_from_patient * Eigen::Vector3d(p + u));
      }
    }
  });
  return out;
}

}  // namespace birdseye::host
