#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"
#include "host/operation/patient.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// Writes what is known of the patient before the operation into the folder: a CT of soft tissue with a marker at each
/// fiducial (DICOM), the fiducials, and the target as a landmark.
Result<host::PatientFiles> write_patient(const std::filesystem::path& folder, const OperationTruth& truth);

}  // namespace birdseye::hw_sim
