#include "host/render/cpu/ray_caster.hpp"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

namespace birdseye::host {

namespace {

void copy(const Eigen::Vector3d& v, float* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(v[axis]);
}

/// Opacity of a step and colour, as the inner loops look them up.
std::vector<std::uint64_t> packed(const TransferFunction& transfer, double step_mm) {
  std::vector<std::uint64_t> table;
  table.reserve(TransferFunction::kHighestHu - TransferFunction::kLowestHu + 1);
  for (int hu = TransferFunction::kLowestHu; hu <= TransferFunction::kHighestHu; ++hu) {
    const TransferFunction::Entry& entry = transfer.at(hu);
    const auto opacity = static_cast<float>(1 - std::exp(-static_cast<double>(entry.extinction_per_mm) * step_mm));
    const auto ten_bits = [](float value) {
      return static_cast<std::uint64_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 1023));
    };
    const std::uint64_t colour = ten_bits(entry.r) | ten_bits(entry.g) << 10U | ten_bits(entry.b) << 20U;
    table.push_back(std::bit_cast<std::uint32_t>(opacity) | colour << 32U);
  }
  return table;
}

}  // namespace

LensRays::LensRays(const CameraModel& camera) : camera_(camera) {
  directions_.resize(static_cast<std::size_t>(blocks()) * 48);
  tbb::parallel_for(0, blocks(), [&](int block) {
    float* const at = &directions_[static_cast<std::size_t>(block) * 48];
    for (int pixel = 0; pixel < 16; ++pixel) {
      const int x = block % blocks_per_row() * 4 + pixel % 4;
      const int y = block / blocks_per_row() * 4 + pixel / 4;
      if (x >= camera.width_px || y >= camera.height_px) continue;
      const auto ray = unproject(camera, Eigen::Vector2d(x, y));
      if (!ray) continue;
      const Eigen::Vector3f unit = ray->normalized().cast<float>();
      for (int axis = 0; axis < 3; ++axis) at[16 * axis + pixel] = unit[axis];
    }
  });
  ranges_.emplace(directions_.data(), blocks_per_row(), blocks());
}

RayCaster::RayCaster(const Volume& volume, const TransferFunction& transfer, cpu::Isa isa, bool prune)
    : volume_(volume), transfer_(transfer), kernels_(cpu::kernels_of(isa)), grid_(volume, transfer_, kernels_, prune) {}

ImageRgba RayCaster::render(const LensRays& rays, const Transform<Camera, Patient>& camera_from_patient,
                            const RenderSettings& settings) {
  const CameraModel& camera = rays.camera();
  ImageRgba image{camera.width_px, camera.height_px, {}};
  image.rgba.resize(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px) * 4);
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Vector3d& eye = patient_from_camera.translation();
  // From ten kilometres nothing is seen, and single precision would end in places that are none of the volume's.
  constexpr double kFarthestEyeMm = 1e7;
  if (!eye.allFinite() || eye.cwiseAbs().maxCoeff() > kFarthestEyeMm) return image;
  const Eigen::Affine3d voxel_from_patient = volume_.patient_from_voxel.inverse();
  grid_.light(eye, settings);

  const std::vector<std::uint64_t> table = packed(transfer_, settings.step_mm);
  cpu::CastJob job;
  job.grid = grid_.view();
  job.directions = rays.directions();
  const std::vector<float> ranges =
      rays.ranges().of(job.grid, Eigen::Affine3d(camera_from_patient.matrix()) * volume_.patient_from_voxel);
  job.ranges = ranges.data();
  job.width_px = camera.width_px;
  job.height_px = camera.height_px;
  job.blocks_per_row = rays.blocks_per_row();
  copy(voxel_from_patient * eye, job.origin);
  const Eigen::Matrix3d voxels_from_camera = voxel_from_patient.linear() * patient_from_camera.rotation();
  for (int row = 0; row < 3; ++row) copy(voxels_from_camera.row(row), job.voxels_from_camera[row]);
  if (settings.clip) {
    copy(patient_from_camera.rotation().transpose() * settings.clip->normal, job.clip_normal);
    job.clip_at_origin_mm = static_cast<float>(settings.clip->normal.dot(eye) - settings.clip->offset_mm);
  }
  job.near_mm = static_cast<float>(settings.near_mm);
  job.step_mm = static_cast<float>(settings.step_mm);
  job.transfer = table.data();
  job.rgba = image.rgba.data();
  // Tiles of 8x8 blocks: rays that are neighbours share what they load, and there are enough tiles to go round.
  constexpr int kTile = 8;
  tbb::parallel_for(
      tbb::blocked_range2d<int>(0, rays.blocks() / rays.blocks_per_row(), kTile, 0, rays.blocks_per_row(), kTile),
      [&](const tbb::blocked_range2d<int>& tile) {
        for (int row = tile.rows().begin(); row != tile.rows().end(); ++row) {
          kernels_.cast(job, row * job.blocks_per_row + tile.cols().begin(),
                        row * job.blocks_per_row + tile.cols().end());
        }
      });
  return image;
}

}  // namespace birdseye::host
