#include "host/registration/views/tissue.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

/// Steps of the grid within which the depth goes on as it is about the boundary, so that splines there see no kink.
constexpr double kReach_steps = 4;

/// Weights of a uniform cubic B-spline and their derivatives, for the four points about a place t past the second.
struct Spline {
  float w[4], d[4];
};
Spline spline(float t) {
  const float u = 1 - t;
  return {{u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6},
          {-u * u / 2, (3 * t - 4) * t / 2, -(3 * u - 4) * u / 2, t * t / 2}};
}

/// How deep a place is, given in steps of the grid, and the gradient there per step: by cubic B-splines, which have no
/// kinks. -reach_mm outside of the box.
float sample(const Tissue& tissue, const float* place, float* gradient) {
  const auto& n = tissue.points;
  int base[3];
  Spline along[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(place[axis] >= 0) || place[axis] > static_cast<float>(n[axis] - 1)) return -tissue.reach_mm;
    base[axis] = std::min(static_cast<int>(place[axis]), n[axis] - 2);
    along[axis] = spline(place[axis] - static_cast<float>(base[axis]));
  }
  if (tissue.level[grid_index(n, base[0], base[1], base[2])] != 0)
    return tissue.spline_mm[grid_index(n, base[0], base[1], base[2])];
  float sum = 0;
  for (int k = 0; k < 4; ++k) {
    const int z = std::clamp(base[2] - 1 + k, 0, n[2] - 1);
    float plane = 0, plane_x = 0, plane_y = 0;
    for (int j = 0; j < 4; ++j) {
      const int y = std::clamp(base[1] - 1 + j, 0, n[1] - 1);
      const float* const row = &tissue.spline_mm[grid_index(n, 0, y, z)];
      float line = 0, line_x = 0;
      for (int i = 0; i < 4; ++i) {
        const float value = row[std::clamp(base[0] - 1 + i, 0, n[0] - 1)];
        line += along[0].w[i] * value;
        line_x += along[0].d[i] * value;
      }
      plane += along[1].w[j] * line;
      plane_x += along[1].w[j] * line_x;
      plane_y += along[1].d[j] * line;
    }
    sum += along[2].w[k] * plane;
    if (gradient != nullptr) {
      gradient[0] += along[2].w[k] * plane_x;
      gradient[1] += along[2].w[k] * plane_y;
      gradient[2] += along[2].d[k] * plane;
    }
  }
  return sum;
}

/// B-splines with the depths themselves as coefficients draw a curved surface inside of where it is, for they give the
/// depth and a sixth of its second difference along each axis; blends add a twelfth, on average over a cell.
std::vector<float> spline_of(const Tissue& tissue) {
  constexpr float kTooMuch = 1.0F / 6 + 1.0F / 12;
  const auto& n = tissue.points;
  std::vector<float> out = tissue.depth_mm;
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const std::size_t v = grid_index(n, x, y, z);
        const std::array<int, 3> p{x, y, z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (p[axis] == 0 || p[axis] == n[axis] - 1) continue;
          const std::size_t step = axis == 0 ? 1 : grid_index(n, 0, axis == 1 ? 1 : 0, axis == 2 ? 1 : 0);
          out[v] -= kTooMuch * (tissue.depth_mm[v - step] - 2 * tissue.depth_mm[v] + tissue.depth_mm[v + step]);
        }
      }
    }
  });
  return out;
}

/// Cells about which nothing changes.
std::vector<std::uint8_t> level_cells(const Tissue& tissue) {
  const auto& n = tissue.points;
  std::vector<std::uint8_t> out(grid_count(n), 0);
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const float here = tissue.spline_mm[grid_index(n, x, y, z)];
        bool same = std::abs(here) >= tissue.reach_mm;
        for (int k = -1; same && k < 3; ++k) {
          for (int j = -1; same && j < 3; ++j) {
            for (int i = -1; same && i < 3; ++i) {
              const float other = tissue.spline_mm[grid_index(
                  n, std::clamp(x + i, 0, n[0] - 1), std::clamp(y + j, 0, n[1] - 1), std::clamp(z + k, 0, n[2] - 1))];
              same = other == here;
            }
          }
        }
        out[grid_index(n, x, y, z)] = same ? 1 : 0;
      }
    }
  });
  return out;
}

}  // namespace

std::vector<std::uint8_t> tissue_voxels(const Volume& ct, const Volume* labels, std::span<const int> values,
                                        const TransferFunction& transfer) {
  std::vector<std::uint8_t> out(ct.hu.size(), 0);
  tbb::parallel_for(0, ct.size[2], [&](int k) {
    for (std::size_t v = ct.index(0, 0, k); v < ct.index(0, 0, k + 1); ++v) {
      if (labels != nullptr && std::find(values.begin(), values.end(), labels->hu[v]) == values.end()) continue;
      out[v] = transfer.at(ct.hu[v]).extinction_per_mm > 0 ? 1 : 0;
    }
  });
  return out;
}

Result<SignedDistance> organ_distance(const Volume& ct, const Volume* labels, std::span<const int> values,
                                      const TransferFunction& transfer) {
  constexpr double kSpacing_mm = 2, kMargin_mm = 24;
  return signed_distance_of(ct, tissue_voxels(ct, labels, values, transfer), kSpacing_mm, kMargin_mm);
}

Tissue tissue_of(const SignedDistance& organ, const Volume& ct, double spacing_mm) {
  Tissue tissue;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<Eigen::Index>(axis);
    const double extent_mm = ct.spacing_mm[n] * (ct.size[axis] - 1);
    tissue.points[axis] = std::max(4, static_cast<int>(std::lround(extent_mm / spacing_mm)) + 1);
    tissue.spacing_mm[n] = extent_mm / (tissue.points[axis] - 1);
  }
  tissue.patient_from_grid.linear() = ct.patient_from_voxel.linear() * ct.spacing_mm.cwiseInverse().asDiagonal();
  tissue.patient_from_grid.translation() = ct.patient_from_voxel.translation();
  tissue.reach_mm = static_cast<float>(kReach_steps * spacing_mm);
  tissue.depth_mm.resize(grid_count(tissue.points));
  tbb::parallel_for(0, tissue.points[2], [&](int z) {
    for (int y = 0; y < tissue.points[1]; ++y) {
      for (int x = 0; x < tissue.points[0]; ++x) {
        const Eigen::Vector3d place_mm =
            tissue.patient_from_grid * Eigen::Vector3d(x, y, z).cwiseProduct(tissue.spacing_mm);
        tissue.depth_mm[grid_index(tissue.points, x, y, z)] =
            std::clamp(static_cast<float>(-organ.distance_mm(place_mm)), -tissue.reach_mm, tissue.reach_mm);
      }
    }
  });
  tissue.spline_mm = spline_of(tissue);
  tissue.level = level_cells(tissue);
  return tissue;
}

Result<Tissue> tissue_of(const Volume& ct, const Volume* labels, std::span<const int> values,
                         const TransferFunction& transfer, double spacing_mm) {
  const auto organ = organ_distance(ct, labels, values, transfer);
  if (!organ) return organ.error();
  return tissue_of(*organ, ct, spacing_mm);
}

void warp(const Tissue& tissue, const std::vector<float>& moves, std::vector<float>& warped) {
  const auto& n = tissue.points;
  warped.resize(grid_count(n));
  const Eigen::Vector3f per_mm = tissue.spacing_mm.cwiseInverse().cast<float>();
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const std::size_t v = grid_index(n, x, y, z);
        const float place[3] = {static_cast<float>(x) + moves[3 * v] * per_mm[0],
                                static_cast<float>(y) + moves[3 * v + 1] * per_mm[1],
                                static_cast<float>(z) + moves[3 * v + 2] * per_mm[2]};
        warped[v] = sample(tissue, place, nullptr);
      }
    }
  });
}

void pull_back_warp(const Tissue& tissue, const std::vector<float>& moves, const std::vector<float>& by_warped,
                    std::vector<float>& by_move) {
  const auto& n = tissue.points;
  by_move.assign(3 * grid_count(n), 0.0F);
  const Eigen::Vector3f per_mm = tissue.spacing_mm.cwiseInverse().cast<float>();
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const std::size_t v = grid_index(n, x, y, z);
        if (by_warped[v] == 0) continue;
        const float place[3] = {static_cast<float>(x) + moves[3 * v] * per_mm[0],
                                static_cast<float>(y) + moves[3 * v + 1] * per_mm[1],
                                static_cast<float>(z) + moves[3 * v + 2] * per_mm[2]};
        float gradient[3] = {0, 0, 0};
        sample(tissue, place, gradient);
        for (int axis = 0; axis < 3; ++axis)
          by_move[3 * v + static_cast<std::size_t>(axis)] = by_warped[v] * gradient[axis] * per_mm[axis];
      }
    }
  });
}

}  // namespace birdseye::host
