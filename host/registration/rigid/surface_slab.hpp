#pragma once

#include "calibration/base/result.hpp"
#include "host/registration/rigid/surface.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

struct SlabSettings {
  double spacing_mm = 0.5;  ///< of its voxels
  double depth_mm = 8;      ///< of tissue behind the surface, along the line of sight
  Eigen::Vector3d seen_from_mm = Eigen::Vector3d::Zero();
};

/// Soft tissue (100 HU) behind a surface, in air: along each line of sight, from where it first meets the surface to
/// depth_mm behind that. An open surface, which has no inside, so becomes a body that looks from there as the surface
/// does. Voxels through which the border passes have a value between both, by their share. Errc::bad_value for sizes
/// that are not positive, more than 64 million voxels, and an eye from which less than one triangle in ten could be met
/// first.
Result<Volume> slab_behind(const Surface& surface, const SlabSettings& settings);

}  // namespace birdseye::host
