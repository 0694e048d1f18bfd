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

/// Soft tissue (100 HU) behind a surface, in air: from where a line of sight first meets the surface on to depth_mm
/// behind it. So an open surface, which has no inside, makes a body that looks as the surface does from there. Voxels
/// that the border passes through are between both, by their share. Errc::bad_value for sizes that are not positive,
/// more than 64 million voxels, and an eye from which less than one triangle in ten could be met first.
Result<Volume> slab_behind(const Surface& surface, const SlabSettings& settings);

}  // namespace birdseye::host
