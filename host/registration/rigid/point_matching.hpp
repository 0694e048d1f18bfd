#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "calibration/points/point_fit.hpp"

namespace birdseye::host {

/// A rigid fit of touched points to points found in the CT, where it was not known which touched point is which CT
/// point.
struct MatchedFit {
  calibration::PointFit<Patient, Tracker> fit;
  std::vector<std::size_t> ct_of_touch;  ///< touched point i is CT point ct_of_touch[i]
};

/// Finds the assignment of touched points to CT points whose fit has the least FRE. The CT may have more points than
/// were touched: markers that were left out, or things that a search took for markers.
///
/// Every assignment is covered, but few are fitted. The distance of two points is the same in both frames, and an
/// assignment that changes one distance by s cannot have an FRE under s / sqrt(2 n).
/// Refuses more touched points than CT points, what fit_points refuses, points that no assignment fits to 15 mm, and
/// (Errc::degenerate) points so regular that another assignment fits nearly as well, for a marker taken for another
/// would turn the patient.
Result<MatchedFit> match_and_fit(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                 std::span<const Eigen::Vector3d> touched_in_tracker_mm);

/// Of touches that were given in the order of the CT's points, as many: the FRE of the other order that fits best,
/// where the residuals do not speak for the given order against it by odds of 100. Empty where they do. Somebody chose
/// the given order, so that less speaks for it than match_and_fit asks for, which knows of none.
std::optional<double> rival_order_fre_mm(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                         std::span<const Eigen::Vector3d> touched_in_tracker_mm);

/// Which touch is off, from 0: without it the others fit to good_fit_mm, and without any other plainly worse. Empty
/// where that cannot be told. ct_of_touches_in_patient_mm: the CT's point of each touch; empty where it is not known
/// which is which.
std::optional<std::size_t> odd_touch(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                     std::span<const Eigen::Vector3d> touched_in_tracker_mm,
                                     std::span<const Eigen::Vector3d> ct_of_touches_in_patient_mm, double good_fit_mm);

}  // namespace birdseye::host
