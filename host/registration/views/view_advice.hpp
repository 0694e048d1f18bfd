#pragma once

#include <optional>
#include <span>

#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// Which view of an organ would tell most beside those that there are.
struct ViewAdvice {
  /// By how much one more view from where the camera is shrinks what the views leave open, in [0, 1].
  double gain_now = 0;
  double gain_best = 0;  ///< the same for the best place in reach
  /// Where to look from instead, in degrees about the organ's middle: to the right and down in the picture as it is
  /// now, one of them not 0. Empty: no place in reach is worth moving to.
  std::optional<Eigen::Vector2d> look_from_deg;
};

/// A view tells where things are across its ray, not along it: of n views with unit rays d, the information on a place
/// is the sum of I - d d^T, and what stays open is the trace of its inverse. (The same rule as for tracked points seen
/// by several cameras: A. Davison and D. Murray, 2002, choose measurements by it.) Rays to the organ's middle are
/// compared, up to 40 degrees from the present one, as far as a port in the abdominal wall lets a laparoscope go. A
/// weak prior stands in for views that are still missing.
ViewAdvice advise_view(std::span<const Transform<Camera, Patient>> kept, const Transform<Camera, Patient>& now,
                       const Eigen::Vector3d& middle_in_patient_mm);

}  // namespace birdseye::host
