#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

/// What a camera shows of light: to this power.
inline constexpr double kGamma = 1 / 2.2;

/// The lamp of a laparoscope: where it is, and how it falls off with distance.
struct Headlight {
  Eigen::Vector3d offset_in_camera_mm = Eigen::Vector3d::Zero();
  double falloff = 2;  ///< brightness goes with distance^-falloff
  double ambient = 0.02;
  double vignette = 0.4;  ///< how much darker the rim of the lens's field is than its middle; grows with radius squared
};

/// A headlight as the tissue's grid has it.
struct Lamp {
  Lamp(const Headlight& light, const Eigen::Vector3d& place, double typical_mm);
  Eigen::Vector3d place_mm;
  float typical2, fall_power, ambient;
};

/// Central differences at a point of the grid, per mm along its axes; one-sided at the faces.
struct Stencil {
  std::size_t low[3], high[3];
  float per_mm[3];
};

/// Shade of a surface: ambient + (1 - ambient) |g . l| / sqrt(|g|^2 + weak^2), times the fall-off, as a camera shows
/// it.
struct Shading {
  float value;
  float by_gradient[3], by_to_lamp[3];  ///< the second at a fixed fall-off
};

struct LitPoint {
  Stencil stencil;
  Shading shading;
  Eigen::Vector3f from_lamp_mm, direction;
  float distance2;
};
/// depth_mm: at the points of the tissue's grid, however deformed.
LitPoint light_point(const Tissue& tissue, const std::vector<float>& depth_mm, const Lamp& lamp, int x, int y, int z);

}  // namespace birdseye::host
