#include "host/registration/geometry/sight.hpp"

#include <cmath>

namespace birdseye::host {

Sight::Sight(const SeenSurface& surface, std::span<const PinholeView> views, const SightLimits& limits)
    : surface_(surface), views_(views), limits_(limits) {
  constexpr int kStep_px = 4;
  depths_.reserve(views.size());
  for (const PinholeView& view : views) depths_.push_back(depth_map(surface, view, kStep_px));
}

bool Sight::sees(std::size_t view, const Eigen::Vector3d& place_in_patient_mm) const {
  const PinholeView& by = views_[view];
  const auto pixel = by.project(place_in_patient_mm);
  const double border_px = limits_.border_px;
  if (!(pixel.depth_mm > 0) || pixel.x_px < border_px || pixel.y_px < border_px ||
      pixel.x_px > by.width_px - 1 - border_px || pixel.y_px > by.height_px - 1 - border_px)
    return false;
  const double depth_mm = static_cast<double>(depths_[view].at(pixel.x_px, pixel.y_px));
  if (!std::isfinite(depth_mm) || depth_mm <= pixel.depth_mm - limits_.behind_mm) return false;
  const Eigen::Vector3d towards = (by.eye_in_patient_mm - place_in_patient_mm).normalized();
  return towards.dot(surface_.normal(place_in_patient_mm)) > limits_.least_facing;
}

std::size_t Sight::seen_by(const Eigen::Vector3d& place_in_patient_mm) const {
  std::size_t out = 0;
  for (std::size_t view = 0; view < views_.size(); ++view) out += sees(view, place_in_patient_mm) ? 1 : 0;
  return out;
}

}  // namespace birdseye::host
