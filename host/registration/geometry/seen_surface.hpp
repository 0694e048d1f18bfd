#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "host/registration/geometry/pinhole_view.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// Where a ray comes closest to an organ.
struct RayMeeting {
  double depth_mm;     ///< of the first place on the surface or, where there is none, of the closest place
  double distance_mm;  ///< there; 0 on the surface
};

/// The organ as a deformation has it now, and how cameras see it.
class SeenSurface {
 public:
  explicit SeenSurface(SignedDistance distance) : distance_(std::move(distance)) {}

  [[nodiscard]] const SignedDistance& distance() const { return distance_; }
  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector3d& place_in_patient_mm) const;
  /// Along eye + depth * ray, for a ray of unit depth; empty where the ray misses the box.
  [[nodiscard]] std::optional<RayMeeting> meet(const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& ray) const;

 private:
  SignedDistance distance_;
};

/// Depth of the surface, mm, at every step_px-th pixel; infinite where it is not met or the lens shows nothing.
struct DepthMap {
  int step_px = 4, columns = 0, rows = 0;
  std::vector<float> depth_mm;
  /// Of the nearest of those pixels.
  [[nodiscard]] float at(double x_px, double y_px) const;
};
DepthMap depth_map(const SeenSurface& surface, const PinholeView& view, int step_px);

}  // namespace birdseye::host
