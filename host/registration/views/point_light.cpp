#include "host/registration/views/point_light.hpp"

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr float kWeakGradient = 0.1F;  ///< of the depth, per mm: far below this there is no surface

Stencil stencil_of(const Tissue& tissue, int x, int y, int z) {
  const int p[3] = {x, y, z};
  Stencil s{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    int low[3] = {x, y, z}, high[3] = {x, y, z};
    low[axis] = std::max(0, p[axis] - 1);
    high[axis] = std::min(tissue.points[axis] - 1, p[axis] + 1);
    s.low[axis] = grid_index(tissue.points, low[0], low[1], low[2]);
    s.high[axis] = grid_index(tissue.points, high[0], high[1], high[2]);
    s.per_mm[axis] =
        static_cast<float>(1 / ((high[axis] - low[axis]) * tissue.spacing_mm[static_cast<Eigen::Index>(axis)]));
  }
  return s;
}

Shading shade(const float g[3], const float l[3], float fall, float ambient) {
  const float below = 1 / std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + kWeakGradient * kWeakGradient);
  const float a = g[0] * l[0] + g[1] * l[1] + g[2] * l[2];
  const float facing = std::abs(a) * below;
  const float linear = ambient + (1 - ambient) * facing;
  Shading s{};
  s.value = fall * std::pow(linear, static_cast<float>(kGamma));
  const float outer = static_cast<float>(kGamma) * s.value / linear * (1 - ambient);
  const float sign = a < 0 ? -1.0F : 1.0F;
  for (int axis = 0; axis < 3; ++axis) {
    s.by_gradient[axis] = outer * below * (sign * l[axis] - facing * g[axis] * below);
    s.by_to_lamp[axis] = outer * below * sign * g[axis];
  }
  return s;
}

}  // namespace

Lamp::Lamp(const Headlight& light, const Eigen::Vector3d& place, double typical_mm)
    : place_mm(place),
      typical2(static_cast<float>(typical_mm * typical_mm)),
      fall_power(static_cast<float>(-0.5 * kGamma * light.falloff)),
      ambient(static_cast<float>(light.ambient)) {}

LitPoint light_point(const Tissue& tissue, const std::vector<float>& depth_mm, const Lamp& lamp, int x, int y, int z) {
  LitPoint out{};
  out.stencil = stencil_of(tissue, x, y, z);
  const Stencil& s = out.stencil;
  float g[3];
  for (std::size_t axis = 0; axis < 3; ++axis)
    g[axis] = (depth_mm[s.high[axis]] - depth_mm[s.low[axis]]) * s.per_mm[axis];
  out.from_lamp_mm = (Eigen::Vector3d(x, y, z).cwiseProduct(tissue.spacing_mm) - lamp.place_mm).cast<float>();
  out.distance2 = std::max(1.0F, out.from_lamp_mm.squaredNorm());
  out.direction = out.from_lamp_mm / std::sqrt(out.distance2);
  const float fall = std::pow(out.distance2 / lamp.typical2, lamp.fall_power);
  out.shading = shade(g, out.direction.data(), fall, lamp.ambient);
  return out;
}

}  // namespace birdseye::host
