#include "host/render/cpu/ray_caster.hpp"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace birdseye::host {

namespace {

using Eigen::Vector3f;

constexpr float kOpaque = 1.0F / 512;

/// To the nearest whole number, of a value that is not negative: std::lround is a call, and this runs for every sample.
std::size_t nearest(float value) {
  return static_cast<std::size_t>(value + 0.5F);  // NOLINT(bugprone-incorrect-roundings)
}

std::uint8_t byte_of(float value) {
  return static_cast<std::uint8_t>(nearest(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

}  // namespace

LensRays::LensRays(const CameraModel& camera) : camera_(camera) {
  directions_.resize(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  tbb::parallel_for(0, camera.height_px, [&](int y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto ray = unproject(camera, Eigen::Vector2d(x, y));
      directions_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) +
                  static_cast<std::size_t>(x)] =
          ray ? Vector3f(ray->normalized().cast<float>()) : Vector3f(Vector3f::Zero());
    }
  });
}

RayCaster::RayCaster(const Volume& volume, const TransferFunction& transfer) : volume_(volume), transfer_(transfer) {
  const auto& n = volume.size;
  last_ = Vector3f(static_cast<float>(n[0] - 1), static_cast<float>(n[1] - 1), static_cast<float>(n[2] - 1));
  patient_gradient_from_voxel_ = volume.patient_from_voxel.linear().inverse().transpose().cast<float>();
  for (std::size_t axis = 0; axis < 3; ++axis) bricks_[axis] = std::max(1, (n[axis] - 1 + kBrick - 1) / kBrick);
  constexpr std::uint8_t kFar = 255;
  empty_.resize(static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                static_cast<std::size_t>(bricks_[2]));
  tbb::parallel_for(0, bricks_[2], [&](int bk) {
    for (int bj = 0; bj < bricks_[1]; ++bj) {
      for (int bi = 0; bi < bricks_[0]; ++bi) {
        // A brick's cells reach one voxel into the next brick.
        std::int16_t low = std::numeric_limits<std::int16_t>::max();
        std::int16_t high = std::numeric_limits<std::int16_t>::min();
        for (int k = bk * kBrick; k <= std::min(bk * kBrick + kBrick, n[2] - 1); ++k) {
          for (int j = bj * kBrick; j <= std::min(bj * kBrick + kBrick, n[1] - 1); ++j) {
            for (int i = bi * kBrick; i <= std::min(bi * kBrick + kBrick, n[0] - 1); ++i) {
              low = std::min(low, volume.at(i, j, k));
              high = std::max(high, volume.at(i, j, k));
            }
          }
        }
        const auto at =
            (static_cast<std::size_t>(bk) * static_cast<std::size_t>(bricks_[1]) + static_cast<std::size_t>(bj)) *
                static_cast<std::size_t>(bricks_[0]) +
            static_cast<std::size_t>(bi);
        empty_[at] = transfer_.any_seen(low, high) ? 0 : kFar;
      }
    }
  });
  measure_empty_bricks();
}

void RayCaster::measure_empty_bricks() {
  // Chessboard distance is separable into two sweeps over the 13 neighbours that come before, and after, in memory.
  const auto [nx, ny, nz] = bricks_;
  const auto index = [nx = nx, ny = ny](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(i);
  };
  for (const int way : {1, -1}) {
    for (int kk = 0; kk < nz; ++kk) {
      for (int jj = 0; jj < ny; ++jj) {
        for (int ii = 0; ii < nx; ++ii) {
          const int i = way > 0 ? ii : nx - 1 - ii;
          const int j = way > 0 ? jj : ny - 1 - jj;
          const int k = way > 0 ? kk : nz - 1 - kk;
          int nearest = empty_[index(i, j, k)];
          for (int n = 0; n < 13 && nearest > 0; ++n) {
            const int a = i + way * (n % 3 - 1);
            const int b = j + way * (n / 3 % 3 - 1);
            const int c = k + way * (n / 9 - 1);
            if (a < 0 || b < 0 || c < 0 || a >= nx || b >= ny || c >= nz) continue;
            nearest = std::min(nearest, empty_[index(a, b, c)] + 1);
          }
          empty_[index(i, j, k)] = static_cast<std::uint8_t>(nearest);
        }
      }
    }
  }
}

float RayCaster::trilinear(const Vector3f& x) const {
  const int i = std::min(static_cast<int>(x.x()), std::max(0, volume_.size[0] - 2));
  const int j = std::min(static_cast<int>(x.y()), std::max(0, volume_.size[1] - 2));
  const int k = std::min(static_cast<int>(x.z()), std::max(0, volume_.size[2] - 2));
  const float u = x.x() - static_cast<float>(i);
  const float v = x.y() - static_cast<float>(j);
  const float w = x.z() - static_cast<float>(k);
  const std::size_t dx = volume_.size[0] > 1 ? 1 : 0;
  const std::size_t dy = volume_.size[1] > 1 ? static_cast<std::size_t>(volume_.size[0]) : 0;
  const std::size_t dz =
      volume_.size[2] > 1 ? static_cast<std::size_t>(volume_.size[0]) * static_cast<std::size_t>(volume_.size[1]) : 0;
  const std::int16_t* p = volume_.hu.data() + volume_.index(i, j, k);
  const auto along_x = [&](const std::int16_t* q) {
    const float a = q[0];
    return a + u * (static_cast<float>(q[dx]) - a);
  };
  const float a = along_x(p);
  const float b = along_x(p + dy);
  const float c = along_x(p + dz);
  const float d = along_x(p + dy + dz);
  const float ab = a + v * (b - a);
  const float cd = c + v * (d - c);
  return ab + w * (cd - ab);
}

Vector3f RayCaster::gradient(const Vector3f& x) const {
  Vector3f g;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3f after = x;
    Vector3f before = x;
    after[axis] = std::min(x[axis] + 1, last_[axis]);
    before[axis] = std::max(x[axis] - 1, 0.0F);
    g[axis] = 0.5F * (trilinear(after) - trilinear(before));
  }
  return g;
}

/// A ray in voxel coordinates: x(s) = origin + s * step, s in mm; direction is its unit direction in the patient.
struct RayCaster::Ray {
  Vector3f origin, step, direction;
  float enter_mm, leave_mm;
};

/// What one picture's samples share: powers and exponentials, which cost more than all else of a sample.
struct RayCaster::Tables {
  static constexpr int kFacings = 2048;
  std::array<float, kFacings + 1> highlight;
  std::array<float, TransferFunction::kHighestHu - TransferFunction::kLowestHu + 1> opacity;

  Tables(const TransferFunction& transfer, const RenderSettings& settings) {
    for (int i = 0; i <= kFacings; ++i) {
      const double facing = static_cast<double>(i) / kFacings;
      highlight[static_cast<std::size_t>(i)] =
          static_cast<float>(settings.specular * std::pow(facing, settings.shininess));
    }
    for (int hu = TransferFunction::kLowestHu; hu <= TransferFunction::kHighestHu; ++hu) {
      const auto extinction = static_cast<double>(transfer.at(hu).extinction_per_mm);
      opacity[static_cast<std::size_t>(hu - TransferFunction::kLowestHu)] =
          static_cast<float>(1 - std::exp(-extinction * settings.step_mm));
    }
  }
  [[nodiscard]] float opacity_at(int hu) const {
    return opacity[static_cast<std::size_t>(std::clamp(hu, TransferFunction::kLowestHu, TransferFunction::kHighestHu) -
                                            TransferFunction::kLowestHu)];
  }
};

/// A displacement field as samples need it: in voxels of the volume, with how far it moves anything at most.
class RayCaster::Warp {
 public:
  Warp(const DisplacementField& field, const Volume& volume) : size_(field.size) {
    const Eigen::Affine3d voxel_from_patient = volume.patient_from_voxel.inverse();
    const Eigen::Affine3d lattice_from_voxel = field.patient_from_lattice.inverse() * volume.patient_from_voxel;
    lattice_from_voxel_ = lattice_from_voxel.linear().cast<float>();
    offset_ = lattice_from_voxel.translation().cast<float>();
    const Eigen::Matrix3f to_voxels = voxel_from_patient.linear().cast<float>();
    moves_.reserve(field.displacement_mm.size());
    for (const Vector3f& u : field.displacement_mm) {
      moves_.emplace_back(to_voxels * u);
      most_ = std::max(most_, moves_.back().cwiseAbs().maxCoeff());
    }
  }
  /// The largest displacement along any voxel axis, voxels.
  [[nodiscard]] float most() const { return most_; }
  /// u(x) and du/dx in voxels; both zero outside the field.
  void at(const Vector3f& x, Vector3f& u, Eigen::Matrix3f& gradient) const {
    const Vector3f lattice = lattice_from_voxel_ * x + offset_;
    u.setZero();
    gradient.setZero();
    int base[3];
    float t[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int last = size_[static_cast<std::size_t>(axis)] - 1;
      if (!(lattice[axis] >= 0 && lattice[axis] <= static_cast<float>(last))) return;
      base[axis] = std::min(static_cast<int>(lattice[axis]), std::max(0, last - 1));
      t[axis] = lattice[axis] - static_cast<float>(base[axis]);
    }
    const auto row = static_cast<std::size_t>(size_[0]);
    const std::size_t slice = row * static_cast<std::size_t>(size_[1]);
    const Vector3f* const p = &moves_[static_cast<std::size_t>(base[2]) * slice +
                                      static_cast<std::size_t>(base[1]) * row + static_cast<std::size_t>(base[0])];
    // Along x, then y, then z; the differences on the way are the derivatives.
    Vector3f value[4], slope[4];
    for (std::size_t n = 0; n < 4; ++n) {
      const Vector3f* const q = p + (n & 1U) * row + (n >> 1U) * slice;
      slope[n] = q[1] - q[0];
      value[n] = q[0] + t[0] * slope[n];
    }
    const Vector3f low = value[0] + t[1] * (value[1] - value[0]);
    const Vector3f high = value[2] + t[1] * (value[3] - value[2]);
    u = low + t[2] * (high - low);
    const Vector3f low_x = slope[0] + t[1] * (slope[1] - slope[0]);
    const Vector3f high_x = slope[2] + t[1] * (slope[3] - slope[2]);
    Eigen::Matrix3f by_lattice;
    by_lattice.col(0) = low_x + t[2] * (high_x - low_x);
    by_lattice.col(1) = (value[1] - value[0]) + t[2] * ((value[3] - value[2]) - (value[1] - value[0]));
    by_lattice.col(2) = high - low;
    gradient = by_lattice * lattice_from_voxel_;
  }

 private:
  std::array<int, 3> size_;
  Eigen::Matrix3f lattice_from_voxel_;
  Vector3f offset_;
  std::vector<Vector3f> moves_;
  float most_ = 0;
};

Eigen::Array4f RayCaster::march(const Ray& ray, const Tables& tables, const Warp* warp,
                                const RenderSettings& settings) const {
  // What a sample reads may lie this many bricks from where the sample is: that much nearer, emptiness is not to be
  // had.
  const int margin = warp == nullptr ? 0 : static_cast<int>(std::ceil(warp->most() / kBrick));
  Vector3f move = Vector3f::Zero();
  Eigen::Matrix3f move_gradient = Eigen::Matrix3f::Zero();
  const auto h = static_cast<float>(settings.step_mm);
  const auto ambient = static_cast<float>(settings.ambient);
  const auto diffuse = static_cast<float>(settings.diffuse);
  const float per_g0 = 1.0F / static_cast<float>(settings.surface_gradient_hu_per_mm);
  Eigen::Array3f colour = Eigen::Array3f::Zero();
  float transmittance = 1;
  // Whole numbers of steps, so that every ray samples the same distances.
  auto i = static_cast<long>(std::ceil(ray.enter_mm / h - 0.5F));
  const auto end = static_cast<long>(std::floor(ray.leave_mm / h - 0.5F));
  while (i <= end && transmittance >= kOpaque) {
    const float s = (static_cast<float>(i) + 0.5F) * h;
    const Vector3f x = (ray.origin + s * ray.step).cwiseMax(0.0F).cwiseMin(last_);
    int brick[3];
    for (int axis = 0; axis < 3; ++axis) {
      brick[axis] = std::min(static_cast<int>(x[axis]) / kBrick, bricks_[static_cast<std::size_t>(axis)] - 1);
    }
    const int empty = empty_[(static_cast<std::size_t>(brick[2]) * static_cast<std::size_t>(bricks_[1]) +
                              static_cast<std::size_t>(brick[1])) *
                                 static_cast<std::size_t>(bricks_[0]) +
                             static_cast<std::size_t>(brick[0])] -
                      margin;
    if (empty > 0) {
      // To the first sample past the cube of empty bricks around this one.
      float exit = std::numeric_limits<float>::max();
      for (int axis = 0; axis < 3; ++axis) {
        const int face = (ray.step[axis] > 0 ? brick[axis] + empty : brick[axis] - empty + 1) * kBrick;
        if (std::abs(ray.step[axis]) > 1e-12F)
          exit = std::min(exit, (static_cast<float>(face) - x[axis]) / ray.step[axis]);
      }
      i += std::max(1L, static_cast<long>(exit / h));
      continue;
    }
    ++i;
    Vector3f y = x;
    if (warp != nullptr) {
      warp->at(x, move, move_gradient);
      y += move;
      if (y.minCoeff() < 0 || (last_ - y).minCoeff() < 0) continue;
    }
    const float f = trilinear(y);
    const int hu = static_cast<int>(f + (f < 0 ? -0.5F : 0.5F));
    const float opacity = tables.opacity_at(hu);
    if (opacity <= 0) continue;
    const TransferFunction::Entry& entry = transfer_.at(hu);
    Vector3f in_voxels = gradient(y);
    if (warp != nullptr) in_voxels += move_gradient.transpose() * in_voxels.eval();
    const Vector3f g = patient_gradient_from_voxel_ * in_voxels;
    const float length = g.norm();
    const float surface = std::min(1.0F, length * per_g0);
    const float facing = length > 0 ? std::min(1.0F, std::abs(g.dot(ray.direction)) / length) : 0.0F;
    const float shade = (1 - surface) + surface * (ambient + diffuse * facing);
    const float highlight = surface * tables.highlight[nearest(facing * Tables::kFacings)];
    const Eigen::Array3f lit = (Eigen::Array3f(entry.r, entry.g, entry.b) * shade + highlight).min(1.0F);
    colour += transmittance * opacity * lit;
    transmittance *= 1 - opacity;
  }
  return {colour[0], colour[1], colour[2], 1 - transmittance};
}

ImageRgba RayCaster::render(const LensRays& rays, const Transform<Camera, Patient>& camera_from_patient,
                            const RenderSettings& settings, const DisplacementField* deformation) const {
  const CameraModel& camera = rays.camera();
  std::optional<Warp> warp;
  if (deformation != nullptr) warp.emplace(*deformation, volume_);
  ImageRgba image{camera.width_px, camera.height_px, {}};
  image.rgba.resize(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px) * 4);
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Affine3d voxel_from_patient = volume_.patient_from_voxel.inverse();
  const Vector3f origin = (voxel_from_patient * patient_from_camera.translation()).cast<float>();
  const Eigen::Matrix3f step_from_camera = (voxel_from_patient.linear() * patient_from_camera.rotation()).cast<float>();
  const Eigen::Matrix3f patient_rotation = patient_from_camera.rotation().cast<float>();

  const Tables tables(transfer_, settings);
  const auto cast = [&](std::size_t pixel) {
    const Vector3f& in_camera = rays.at(pixel);
    if (in_camera.z() == 0) return;
    Ray ray{origin, step_from_camera * in_camera, patient_rotation * in_camera, static_cast<float>(settings.near_mm),
            std::numeric_limits<float>::max()};
    for (int axis = 0; axis < 3; ++axis) {
      const float a = -ray.origin[axis] / ray.step[axis];
      const float b = (last_[axis] - ray.origin[axis]) / ray.step[axis];
      if (std::abs(ray.step[axis]) > 1e-12F) {
        ray.enter_mm = std::max(ray.enter_mm, std::min(a, b));
        ray.leave_mm = std::min(ray.leave_mm, std::max(a, b));
      } else if (ray.origin[axis] < 0 || ray.origin[axis] > last_[axis]) {
        return;
      }
    }
    if (settings.clip) {
      const double along = settings.clip->normal.dot(ray.direction.cast<double>());
      const double before = settings.clip->offset_mm - settings.clip->normal.dot(patient_from_camera.translation());
      const auto at = static_cast<float>(before / (std::abs(along) > 1e-12 ? along : 1e-12));
      (along > 0 ? ray.enter_mm = std::max(ray.enter_mm, at) : ray.leave_mm = std::min(ray.leave_mm, at));
    }
    if (!(ray.enter_mm < ray.leave_mm)) return;
    const Eigen::Array4f rgba = march(ray, tables, warp ? &*warp : nullptr, settings);
    for (std::size_t channel = 0; channel < 4; ++channel) {
      image.rgba[4 * pixel + channel] = byte_of(rgba[static_cast<Eigen::Index>(channel)]);
    }
  };
  constexpr int kTile = 16;
  tbb::parallel_for(
      tbb::blocked_range2d<int>(0, camera.height_px, kTile, 0, camera.width_px, kTile),
      [&](const tbb::blocked_range2d<int>& tile) {
        for (int y = tile.rows().begin(); y != tile.rows().end(); ++y) {
          for (int x = tile.cols().begin(); x != tile.cols().end(); ++x) {
            cast(static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) + static_cast<std::size_t>(x));
          }
        }
      });
  return image;
}

}  // namespace birdseye::host
