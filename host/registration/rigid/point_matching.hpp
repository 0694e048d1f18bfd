#pragma once

#include <span>

#include "calibration/points/point_fit.hpp"

namespace birdseye::host {

/// A rigid fit between points found in the CT and points touched on the patient, of which nobody has said which is
/// which.
struct MatchedFit {
  calibration::PointFit<Patient, Tracker> fit;
  std::vector<std::size_t> ct_of_touch;  ///< touched point i is CT point ct_of_touch[i]
};

/// Takes the assignment of touched points to CT points of least FRE. The CT may hold more points than were touched:
/// markers left out, or what a search took for one.
///
/// Every assignment is covered, but few are looked at: two points' distance is the same in both frames, and an
/// assignment that stretches one by s cannot have an FRE under s / sqrt(2 n).
/// Refuses more touched points than CT points, what fit_points refuses, points no assignment of which fits to 15 mm,
/// and (Errc::degenerate) points so alike that another assignment fits nearly as well: a marker taken for another
/// would turn the patient.
Result<MatchedFit> match_and_fit(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                 std::span<const Eigen::Vector3d> touched_in_tracker_mm);

}  // namespace birdseye::host
