#pragma once

#include <span>
#include <vector>

#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/step_states.hpp"

namespace birdseye::host {

/// Where the CT that is shown has a place of the CT as it was taken. deformed: null where it is not.
Eigen::Vector3d as_shown_mm(const Eigen::Vector3d& place_in_ct_mm, const DeformedOrgan* deformed);

CheckReading check_by_landmarks(const Eigen::Vector3d& tip_in_tracker_mm, const RegisteredPatient& registered,
                                std::span<const NamedPoint> landmarks,
                                const std::vector<Eigen::Vector3d>& markers_in_patient_mm,
                                const DeformedOrgan* deformed);

}  // namespace birdseye::host
