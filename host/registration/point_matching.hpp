#pragma once

#include <span>

#include "calibration/solve/point_fit.hpp"

namespace birdseye::host {

/// A rigid fit between points found in the CT and points touched on the patient, of which nobody has said which is
/// which.
struct MatchedFit {
  calibration::PointFit<Patient, Tracker> fit;
  std::vector<std::size_t> ct_of_touch;  ///< touched point i is CT point ct_of_touch[i]
};

/// Tries every order and takes the one of least FRE. Refuses more than eight points, unequal counts, what fit_points
/// refuses, and (Errc::degenerate) points so alike that another order fits nearly as well: a marker taken for another
/// would turn the patient.
Result<MatchedFit> match_and_fit(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                 std::span<const Eigen::Vector3d> touched_in_tracker_mm);

}  // namespace birdseye::host
