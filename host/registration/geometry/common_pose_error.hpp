#pragma once

#include <Eigen/Core>

#include "host/registration/geometry/pinhole_view.hpp"
#include "host/registration/geometry/seen_point.hpp"

namespace birdseye::host {

/// How a place moves with a shift, a turn and a scale of everything about another.
Eigen::Matrix<double, 3, kCommonErrors> moves_by(const Eigen::Vector3d& from_middle_mm);

/// The error of places of the patient by the shift, turn and scale that all views share: the views show little or
/// nothing of these, so that the poses' noise leaves them uncertain.
class CommonPoseError {
 public:
  using Covariance = Eigen::Matrix<double, kCommonErrors, kCommonErrors>;

  /// motion: of shift (mm), turn (rotation vector) and scale (a share) about about_mm.
  CommonPoseError(Eigen::Vector3d about_mm, const Covariance& motion);
  [[nodiscard]] const Eigen::Vector3d& about_mm() const { return about_mm_; }
  [[nodiscard]] ByCommonErrors at(const Eigen::Vector3d& place_mm) const;
  /// Where the view was taken from, if the views have these errors.
  [[nodiscard]] Transform<Camera, Patient> without(const CommonErrors& errors, const PinholeView& view) const;

 private:
  Eigen::Vector3d about_mm_;
  Covariance factor_;  ///< its product with its transpose is the motion's covariance
};

}  // namespace birdseye::host
