#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"
#include "host/operation/patient.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// What is known of the patient before the operation.
enum class PatientHas {
  markers,  ///< a CT of soft tissue with a marker at each fiducial (DICOM), the fiducials, and the target as a
            ///< landmark
  markers_and_organ,  ///< the organ too, in the CT and as a label
};

/// Writes it into the folder.
Result<host::PatientFiles> write_patient(const std::filesystem::path& folder, const OperationTruth& truth,
                                         PatientHas has);

}  // namespace birdseye::hw_sim
