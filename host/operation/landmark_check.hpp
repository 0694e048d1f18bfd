#pragma once

#include <string>
#include <vector>

#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"

namespace birdseye::host {

/// What the pointer's tip is near to, in the CT as it is shown.
struct CheckReading {
  Eigen::Vector3d tip_in_patient_mm;
  std::string nearest;  ///< landmark or fiducial; empty: there is none
  double distance_mm = 0;
};

/// Where the CT that is shown has a place of the CT as it was taken. deformed: null where it is not.
Eigen::Vector3d as_shown_mm(const Eigen::Vector3d& place_in_ct_mm, const DeformedOrgan* deformed);

CheckReading check_by_landmarks(const Eigen::Vector3d& tip_in_tracker_mm, const RegisteredPatient& registered,
                                const PatientPlan& plan, const std::vector<Eigen::Vector3d>& markers_in_patient_mm,
                                const DeformedOrgan* deformed);

}  // namespace birdseye::host
