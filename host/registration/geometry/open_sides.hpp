#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// What is known of a place of the surface. Patient frame, mm.
struct KnownPlace {
  Eigen::Vector3d rest_mm, seen_mm;
  Eigen::Vector3d normal;  ///< of the surface where it is seen, outwards
  bool seen = false;       ///< by a view
  Eigen::Matrix3d covariance, prior_covariance;
};

/// The sides of which a tenth or more is open.
std::vector<OpenSide> open_sides(std::span<const KnownPlace> places);

}  // namespace birdseye::host
