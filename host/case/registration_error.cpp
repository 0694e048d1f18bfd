#include "host/case/registration_error.hpp"

#include <algorithm>

namespace birdseye::host {

std::optional<LandmarkError> landmark_error(const std::vector<Landmark>& landmarks, const std::string& prefix,
                                            const DisplacementField* field,
                                            const Transform<Patient, Patient>& model_from_found) {
  LandmarkError error;
  int count = 0;
  for (const Landmark& landmark : landmarks) {
    if (landmark.name.rfind(prefix, 0) != 0) continue;
    const Eigen::Vector3d now = field != nullptr ? field->deformed_of(landmark.rest_mm) : landmark.rest_mm;
    const double mm = (model_from_found * now - landmark.deformed_mm).norm();
    error.mean_mm += mm;
    error.max_mm = std::max(error.max_mm, mm);
    ++count;
  }
  if (count == 0) return std::nullopt;
  error.mean_mm /= count;
  return error;
}

}  // namespace birdseye::host
