#include "host/registration/views/tissue.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr double kMostSmoothing_mm = 2.5;

std::size_t at(int value) {
  return static_cast<std::size_t>(value);
}

/// Along one axis, by a Gaussian; past the faces as at them.
void smooth(std::vector<float>& values, const std::array<int, 3>& points, std::size_t axis, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  if (reach == 0) return;
  std::vector<float> weights;
  float total = 0;
  for (int i = -reach; i <= reach; ++i) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    total += weights.back();
  }
  const std::vector<float> before = values;
  tbb::parallel_for(0, points[2], [&](int k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        float sum = 0;
        for (int n = -reach; n <= reach; ++n) {
          std::array<int, 3> p{i, j, k};
          p[axis] = std::clamp(p[axis] + n, 0, points[axis] - 1);
          sum += weights[at(n + reach)] * before[grid_index(points, p[0], p[1], p[2])];
        }
        values[grid_index(points, i, j, k)] = sum / total;
      }
    }
  });
}

/// How much of what is round each point of the tissue's grid is tissue.
std::vector<float> occupancy_of(const Volume& ct, const std::vector<std::uint8_t>& voxels, const Tissue& tissue) {
  // The mean of the voxels whose centres lie within half a step of the point, or the nearest where none does.
  std::array<std::vector<std::pair<int, int>>, 3> ranges;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double voxels_per_point = static_cast<double>(ct.size[axis] - 1) / (tissue.points[axis] - 1);
    for (int p = 0; p < tissue.points[axis]; ++p) {
      const double centre = p * voxels_per_point;
      int first = static_cast<int>(std::ceil(centre - 0.5 * voxels_per_point));
      int last = static_cast<int>(std::floor(centre + 0.5 * voxels_per_point));
      if (last < first) first = last = static_cast<int>(std::lround(centre));
      ranges[axis].emplace_back(std::max(first, 0), std::min(last, ct.size[axis] - 1));
    }
  }
  std::vector<float> out(grid_count(tissue.points));
  tbb::parallel_for(0, tissue.points[2], [&](int z) {
    for (int y = 0; y < tissue.points[1]; ++y) {
      for (int x = 0; x < tissue.points[0]; ++x) {
        float sum = 0;
        int count = 0;
        for (int k = ranges[2][at(z)].first; k <= ranges[2][at(z)].second; ++k) {
          for (int j = ranges[1][at(y)].first; j <= ranges[1][at(y)].second; ++j) {
            for (int i = ranges[0][at(x)].first; i <= ranges[0][at(x)].second; ++i, ++count)
              sum += voxels[ct.index(i, j, k)];
          }
        }
        out[grid_index(tissue.points, x, y, z)] = sum / static_cast<float>(count);
      }
    }
  });
  return out;
}

/// Weights of a uniform cubic B-spline and their derivatives, for the four points about a place t past the second.
struct Spline {
  float w[4], d[4];
};
Spline spline(float t) {
  const float u = 1 - t;
  return {{u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6},
          {-u * u / 2, (3 * t - 4) * t / 2, -(3 * u - 4) * u / 2, t * t / 2}};
}

/// The tissue at a place given in steps of the grid, and its gradient there per step: by cubic B-splines with the
/// occupancies as coefficients, which smooth a little more and have no kinks. 0 outside of the box.
float sample(const Tissue& tissue, const float* place, float* gradient) {
  const auto& n = tissue.points;
  int base[3];
  Spline along[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(place[axis] >= 0) || place[axis] > static_cast<float>(n[axis] - 1)) return 0;
    base[axis] = std::min(static_cast<int>(place[axis]), n[axis] - 2);
    along[axis] = spline(place[axis] - static_cast<float>(base[axis]));
  }
  if (tissue.level[grid_index(n, base[0], base[1], base[2])] != 0)
    return tissue.occupancy[grid_index(n, base[0], base[1], base[2])];
  float sum = 0;
  for (int k = 0; k < 4; ++k) {
    const int z = std::clamp(base[2] - 1 + k, 0, n[2] - 1);
    float plane = 0, plane_x = 0, plane_y = 0;
    for (int j = 0; j < 4; ++j) {
      const int y = std::clamp(base[1] - 1 + j, 0, n[1] - 1);
      const float* const row = &tissue.occupancy[grid_index(n, 0, y, z)];
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

/// Cells about which nothing changes.
std::vector<std::uint8_t> level_cells(const Tissue& tissue) {
  const auto& n = tissue.points;
  std::vector<std::uint8_t> out(grid_count(n), 0);
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const float here = tissue.occupancy[grid_index(n, x, y, z)];
        bool same = here < 1e-6F || here > 1 - 1e-6F;
        for (int k = -1; same && k < 3; ++k) {
          for (int j = -1; same && j < 3; ++j) {
            for (int i = -1; same && i < 3; ++i) {
              const float other = tissue.occupancy[grid_index(
                  n, std::clamp(x + i, 0, n[0] - 1), std::clamp(y + j, 0, n[1] - 1), std::clamp(z + k, 0, n[2] - 1))];
              same = std::abs(other - here) < 1e-6F;
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

Result<Tissue> tissue_of(const Volume& ct, const Volume* labels, std::span<const int> values,
                         const TransferFunction& transfer, double spacing_mm) {
  Tissue tissue;
  const Eigen::Matrix3d axes = ct.patient_from_voxel.linear() * ct.spacing_mm.cwiseInverse().asDiagonal();
  if ((axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-3) {
    return Error{Errc::bad_value, "the volume's axes are not at right angles; resample it"};
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<Eigen::Index>(axis);
    if (ct.size[axis] < 2) return Error{Errc::bad_value, "the volume has an axis of a single voxel"};
    const double extent_mm = ct.spacing_mm[n] * (ct.size[axis] - 1);
    tissue.points[axis] = std::max(4, static_cast<int>(std::lround(extent_mm / spacing_mm)) + 1);
    tissue.spacing_mm[n] = extent_mm / (tissue.points[axis] - 1);
  }
  tissue.patient_from_grid.linear() = axes;
  tissue.patient_from_grid.translation() = ct.patient_from_voxel.translation();
  tissue.occupancy = occupancy_of(ct, tissue_voxels(ct, labels, values, transfer), tissue);
  const double smoothing_mm = std::min(kMostSmoothing_mm, spacing_mm);  // a small organ keeps its shape
  for (std::size_t axis = 0; axis < 3; ++axis) {
    smooth(tissue.occupancy, tissue.points, axis, smoothing_mm / tissue.spacing_mm[static_cast<Eigen::Index>(axis)]);
  }
  tissue.level = level_cells(tissue);
  if (std::none_of(tissue.occupancy.begin(), tissue.occupancy.end(), [](float o) { return o > kSurface; }))
    return Error{Errc::not_found, "nothing of the volume is seen; check label_values and the transfer function"};
  return tissue;
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
