#pragma once

#include <Eigen/Core>

namespace birdseye::host {

/// A place of the organ that is known both at rest and now, patient mm: a landmark, the branch of a vessel.
struct MatchedPoint {
  Eigen::Vector3d rest_mm;
  Eigen::Vector3d seen_mm;
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Identity();  ///< of seen_mm, given rest_mm; positive definite
};

}  // namespace birdseye::host
