#include "host/registration/geometry/seen_surface.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye::host {

Eigen::Vector3d SeenSurface::normal(const Eigen::Vector3d& place_in_patient_mm) const {
  const Eigen::Vector3d gradient = distance_.sample(place_in_patient_mm).gradient;
  return gradient / std::max(1e-6, gradient.norm());
}

std::optional<RayMeeting> SeenSurface::meet(const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& ray) const {
  const Eigen::Affine3d box_from_patient = distance_.patient_from_box().inverse(Eigen::Isometry);
  const Eigen::Vector3d origin = box_from_patient * eye_mm, direction = box_from_patient.linear() * ray;
  double near = 1, far = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const double v = std::abs(direction[axis]) < 1e-12 ? 1e-12 : direction[axis];
    const double a = -origin[axis] / v, b = (distance_.box_mm()[axis] - origin[axis]) / v;
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  if (near >= far) return std::nullopt;
  const double per_depth = direction.norm();
  // A deformed distance grows a little slower or faster than the way does.
  constexpr double kCautious = 0.7, kLeastStep_mm = 0.3, kClose_mm = 1e-3;
  RayMeeting closest{near, std::numeric_limits<double>::max()};
  double before_mm = closest.distance_mm, before = near;
  for (double depth = near; depth < far;) {
    const double d = distance_.distance_mm(eye_mm + depth * ray);
    if (d <= 0) {
      if (depth == near) return std::nullopt;  // the eye is in the organ
      double low = before, high = depth, low_d = before_mm, high_d = d;
      for (int i = 0; i < 8 && high - low > kClose_mm; ++i) {
        const double middle = low + (high - low) * std::clamp(low_d / (low_d - high_d), 0.05, 0.95);
        const double m = distance_.distance_mm(eye_mm + middle * ray);
        (m > 0 ? low : high) = middle;
        (m > 0 ? low_d : high_d) = m;
        if (std::abs(m) < kClose_mm) break;
      }
      return RayMeeting{low + (high - low) * low_d / (low_d - high_d), 0};
    }
    if (d < closest.distance_mm) closest = {depth, d};
    before = depth;
    before_mm = d;
    depth += std::max(kLeastStep_mm, kCautious * d) / per_depth;
  }
  return closest;
}

float DepthMap::at(double x_px, double y_px) const {
  const int column = std::clamp(static_cast<int>(std::lround(x_px / step_px)), 0, columns - 1);
  const int row = std::clamp(static_cast<int>(std::lround(y_px / step_px)), 0, rows - 1);
  return depth_mm[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
}

DepthMap depth_map(const SeenSurface& surface, const PinholeView& view, int step_px) {
  DepthMap out{step_px, (view.width_px - 1) / step_px + 1, (view.height_px - 1) / step_px + 1, {}};
  out.depth_mm.assign(static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows),
                      std::numeric_limits<float>::infinity());
  tbb::parallel_for(0, out.rows, [&](int row) {
    for (int column = 0; column < out.columns; ++column) {
      if (view.lens.at<std::uint8_t>(row * step_px, column * step_px) == 0) continue;
      const auto met = surface.meet(view.eye_in_patient_mm, view.ray(column * step_px, row * step_px));
      if (met && met->distance_mm == 0) {
        out.depth_mm[static_cast<std::size_t>(row) * static_cast<std::size_t>(out.columns) +
                     static_cast<std::size_t>(column)] = static_cast<float>(met->depth_mm);
      }
    }
  });
  return out;
}

}  // namespace birdseye::host
