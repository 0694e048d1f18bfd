#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// When a view is said to see a place of the surface.
struct SightLimits {
  double least_facing = 0.1;  ///< cosine of the surface's normal and the way to the view's eye
  double behind_mm = 4;       ///< so far behind the surface that the view meets there
  double border_px = 0;       ///< so far from the picture's border
};

/// Which views see a place of a surface. Holds on to both.
class Sight {
 public:
  Sight(const SeenSurface& surface, std::span<const PinholeView> views, const SightLimits& limits = {});

  [[nodiscard]] bool sees(std::size_t view, const Eigen::Vector3d& place_in_patient_mm) const;
  [[nodiscard]] std::size_t seen_by(const Eigen::Vector3d& place_in_patient_mm) const;  ///< how many views
  [[nodiscard]] const DepthMap& depths(std::size_t view) const { return depths_[view]; }

 private:
  const SeenSurface& surface_;
  std::span<const PinholeView> views_;
  SightLimits limits_;
  std::vector<DepthMap> depths_;
};

}  // namespace birdseye::host
