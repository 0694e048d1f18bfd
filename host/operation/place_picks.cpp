#include "host/operation/place_picks.hpp"

#include <utility>

#include "host/volume/marker_near.hpp"

namespace birdseye::host {

void PlacePicks::pick(Kind kind, std::shared_ptr<const PatientPlan> patient,
                      const Eigen::Vector3d& place_in_patient_mm) {
  if (!patient) return;
  looking_.start([kind, patient = std::move(patient), place_in_patient_mm](const std::stop_token&, const auto&) {
    auto marker = find_marker_near(patient->ct, place_in_patient_mm);
    return Picked{kind, patient, place_in_patient_mm, std::move(marker)};
  });
}

}  // namespace birdseye::host
