#include "host/registration/geometry/lattice_field.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {
constexpr double kSpacing_mm = 6;
}

LatticeField::LatticeField(const SignedDistance& organ)
    : spacing_mm_(kSpacing_mm),
      patient_from_box_(organ.patient_from_box()),
      box_from_patient_(organ.patient_from_box().inverse(Eigen::Isometry)) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    points_[axis] = static_cast<int>(std::ceil(organ.box_mm()[static_cast<Eigen::Index>(axis)] / spacing_mm_)) + 1;
  displacement_mm_.assign(grid_count(points_), Eigen::Vector3f::Zero());
}

Eigen::Vector3d LatticeField::place_mm(std::size_t point) const {
  const auto nx = static_cast<std::size_t>(points_[0]), ny = static_cast<std::size_t>(points_[1]);
  const std::size_t i = point % nx, j = point / nx % ny, k = point / (nx * ny);
  return patient_from_box_ *
         (spacing_mm_ * Eigen::Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
}

Eigen::Vector3d LatticeField::at(const Eigen::Vector3d& place_in_patient_mm) const {
  const Eigen::Vector3f x = (box_from_patient_ * place_in_patient_mm / spacing_mm_).cast<float>();
  std::array<int, 3> base{};
  float t[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float v = std::clamp(x[static_cast<Eigen::Index>(axis)], 0.0F, static_cast<float>(points_[axis] - 1));
    base[axis] = std::min(static_cast<int>(v), points_[axis] - 2);
    t[axis] = v - static_cast<float>(base[axis]);
  }
  const auto row = static_cast<std::size_t>(points_[0]), slice = row * static_cast<std::size_t>(points_[1]);
  const Eigen::Vector3f* const v = &displacement_mm_[grid_index(points_, base[0], base[1], base[2])];
  const auto along_x = [&](std::size_t n) -> Eigen::Vector3f { return v[n] + t[0] * (v[n + 1] - v[n]); };
  const auto plane = [&](std::size_t n) -> Eigen::Vector3f {
    const Eigen::Vector3f low = along_x(n);
    return low + t[1] * (along_x(n + row) - low);
  };
  const Eigen::Vector3f low = plane(0);
  return (low + t[2] * (plane(slice) - low)).cast<double>();
}

LatticeField sampled_field(const SignedDistance& organ,
                           const std::function<Eigen::MatrixX3d(const Eigen::MatrixX3d&)>& displacements_mm) {
  constexpr double kNear_mm = 15;
  constexpr int kEvery = 3;
  constexpr std::size_t kBlock = 1024;
  LatticeField out(organ);
  const std::array<int, 3>& points = out.points();
  const auto is_coarse = [&](std::size_t axis, int n) { return n % kEvery == 0 || n == points[axis] - 1; };
  std::vector<std::size_t> sampled;
  std::vector<std::array<int, 3>> between;
  for (int k = 0; k < points[2]; ++k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        const std::size_t point = grid_index(points, i, j, k);
        if ((is_coarse(0, i) && is_coarse(1, j) && is_coarse(2, k)) ||
            organ.distance_mm(out.place_mm(point)) < kNear_mm) {
          sampled.push_back(point);
        } else {
          between.push_back({i, j, k});
        }
      }
    }
  }
  tbb::parallel_for(std::size_t{0}, (sampled.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t first = block * kBlock, last = std::min(sampled.size(), first + kBlock);
    Eigen::MatrixX3d places(static_cast<Eigen::Index>(last - first), 3);
    for (std::size_t n = first; n < last; ++n)
      places.row(static_cast<Eigen::Index>(n - first)) = out.place_mm(sampled[n]).transpose();
    const Eigen::MatrixX3d w_mm = displacements_mm(places);
    for (std::size_t n = first; n < last; ++n)
      out.set(sampled[n], w_mm.row(static_cast<Eigen::Index>(n - first)).transpose());
  });
  for (const std::array<int, 3>& at : between) {
    Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
    for (int n = 0; n < 8; ++n) {
      double weight = 1;
      std::array<int, 3> corner{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int low = at[axis] / kEvery * kEvery, high = std::min(low + kEvery, points[axis] - 1);
        const double t = high > low ? static_cast<double>(at[axis] - low) / (high - low) : 0;
        const bool is_high = (n >> axis & 1) != 0;
        corner[axis] = is_high ? high : low;
        weight *= is_high ? t : 1 - t;
      }
      if (weight > 0) sum_mm += weight * out.displacement_mm(grid_index(points, corner[0], corner[1], corner[2]));
    }
    out.set(grid_index(points, at[0], at[1], at[2]), sum_mm);
  }
  return out;
}

LatticeField seen_from_rest(const LatticeField& rest) {
  LatticeField out = rest;
  tbb::parallel_for(std::size_t{0}, rest.size(), [&](std::size_t n) {
    constexpr int kSteps = 30;
    constexpr double kDamping = 0.8, kClose_mm = 1e-3;
    const Eigen::Vector3d seen = rest.place_mm(n);
    Eigen::Vector3d u = rest.at(seen);
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Vector3d change = rest.at(seen + u) - u;
      u += kDamping * change;
      if (change.norm() < kClose_mm) break;
    }
    out.set(n, u);
  });
  return out;
}

Eigen::Vector3d seen_place(const LatticeField& seen, const Eigen::Vector3d& rest_mm) {
  constexpr int kSteps = 60;
  constexpr double kDamping = 0.8, kClose_mm = 1e-4;
  Eigen::Vector3d place = rest_mm;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d change = rest_mm - seen.at(place) - place;
    place += kDamping * change;
    if (change.norm() < kClose_mm) break;
  }
  return place;
}

SignedDistance seen_distance(const SignedDistance& rest, const LatticeField& seen) {
  const std::array<int, 3>& points = rest.points();
  std::vector<float> distances_mm(grid_count(points));
  tbb::parallel_for(0, points[2], [&](int k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        const Eigen::Vector3d place = rest.patient_from_box() * (rest.spacing_mm() * Eigen::Vector3d(i, j, k));
        distances_mm[grid_index(points, i, j, k)] = static_cast<float>(rest.distance_mm(place + seen.at(place)));
      }
    }
  });
  return {points, rest.spacing_mm(), rest.patient_from_box(), distances_mm};
}

DisplacementField field_over(const Volume& volume, const LatticeField& seen) {
  constexpr int kSide = PatchOctree::kLattice + 1;
  DisplacementField out;
  out.size = {kSide, kSide, kSide};
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  out.patient_from_lattice = volume.patient_from_voxel * Eigen::Scaling(Eigen::Vector3d(last / PatchOctree::kLattice));
  out.displacement_mm.resize(grid_count(out.size));
  tbb::parallel_for(0, kSide, [&](int k) {
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        out.displacement_mm[grid_index(out.size, i, j, k)] =
            seen.at(out.patient_from_lattice * Eigen::Vector3d(i, j, k)).cast<float>();
      }
    }
  });
  return out;
}

}  // namespace birdseye::host
