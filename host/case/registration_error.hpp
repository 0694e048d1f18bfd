#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/case/registration_case.hpp"
#include "host/deform/displacement_field.hpp"

namespace birdseye::host {

struct LandmarkError {
  double mean_mm = 0, max_mm = 0;
};

/// How far landmarks at rest, mapped by field (null: left where they were), are from where they are now. Only landmarks
/// whose names begin with prefix count; "" stands for all. Empty where there are none. model_from_found: what is left
/// of the pose's error, which moves everything that the cameras see.
std::optional<LandmarkError> landmark_error(const std::vector<Landmark>& landmarks, const std::string& prefix,
                                            const DisplacementField* field,
                                            const Transform<Patient, Patient>& model_from_found = {});

}  // namespace birdseye::host
