#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/pinhole_view.hpp"
#include "host/registration/geometry/pose_adjustment.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// The error to be expected at a place, root mean square, and the radius within which the place is with a probability
/// of 95 %: its squared distance is taken to be distributed as chi-squared of the same mean and variance
/// (F. E. Satterthwaite, Biometrics Bulletin 2, 1946), with Wilson and Hilferty's quantile. prior: before anything was
/// seen.
ExpectedError expected_error(const Eigen::Matrix3d& covariance_mm2, const Eigen::Matrix3d& prior_covariance_mm2);

/// Of places spread over the organ: of its surface where views see it and where none does, of its inside, and of the
/// targets, which lay at places of the organ at rest, patient mm; how far what is seen has moved, and what is open.
ExpectedErrors expected_errors(const SignedDistance& organ, const BelievedDeformation& found,
                               std::span<const PinholeView> views, std::span<const Eigen::Vector3d> targets_at_rest_mm);

}  // namespace birdseye::host
