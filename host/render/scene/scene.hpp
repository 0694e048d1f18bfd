#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace birdseye::host {

/// The part of the volume that is kept: normal . p >= offset_mm, p in the patient frame.
struct ClipPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  double offset_mm = 0;
};

/// Settings of a picture; docs/image-formation.md explains each.
struct RenderSettings {
  double step_mm = 0.7;
  double near_mm = 1;
  double ambient = 0.35, diffuse = 0.65, specular = 0.18, shininess = 20;
  double surface_gradient_hu_per_mm = 40;  ///< g0
  std::optional<ClipPlane> clip;
};

/// Premultiplied RGBA, 8 bits, rows from the top.
struct ImageRgba {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgba;
};

/// The picture alone before a plain grey: RGB, rows from the top.
std::vector<std::uint8_t> on_grey(const ImageRgba& image, std::uint8_t grey);

}  // namespace birdseye::host
