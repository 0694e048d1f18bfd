#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/dicom/patient_identity.hpp"

namespace birdseye::host {

/// What of it is known, for files that are asked to name the patient.
nlohmann::json json_of(const PatientIdentity& identity);

}  // namespace birdseye::host
