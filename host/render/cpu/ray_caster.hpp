#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/cpu/seen_ranges.hpp"
#include "host/render/cpu/voxel_grid.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The ray of every pixel of a camera, unit, camera frame; zero where the lens does not see. Takes a while to make, so
/// it is made once per camera. In blocks of 4x4 pixels: 16 x, 16 y, 16 z.
class LensRays {
 public:
  explicit LensRays(const CameraModel& camera);
  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] int blocks_per_row() const { return (camera_.width_px + 3) / 4; }
  [[nodiscard]] int blocks() const { return blocks_per_row() * ((camera_.height_px + 3) / 4); }
  [[nodiscard]] const float* directions() const { return directions_.data(); }
  [[nodiscard]] const cpu::SeenRanges& ranges() const { return *ranges_; }

 private:
  CameraModel camera_;
  std::vector<float> directions_;
  std::optional<cpu::SeenRanges> ranges_;
};

/// Renders a volume by casting rays, in packets, on all cores. Whatever the transfer function does not show is leapt
/// over. The picture is the same to the bit for any number of threads; between instruction sets it differs by rounding.
class RayCaster {
 public:
  /// Keeps a reference to volume, which must outlive it. prune: see VoxelGrid.
  RayCaster(const Volume& volume, const TransferFunction& transfer, cpu::Isa isa = cpu::supported_isas().back(),
            bool prune = true);
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Until the next call, or undeform(), pictures show the volume deformed. Every axis of the volume must have two
  /// voxels or more.
  void deform(const DisplacementField& field) { grid_.deform(field); }
  void undeform() { grid_.undeform(); }
  [[nodiscard]] ImageRgba render(const LensRays& rays, const Transform<Camera, Patient>& camera_from_patient,
                                 const RenderSettings& settings);
  /// Memory beyond the volume's own.
  [[nodiscard]] std::size_t bytes() const { return grid_.bytes(); }

 private:
  const Volume& volume_;
  TransferFunction transfer_;
  const cpu::Kernels& kernels_;
  cpu::VoxelGrid grid_;
};

}  // namespace birdseye::host
