#include "host/operation/landmark_check.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/texts/texts.hpp"

namespace birdseye::host {

Eigen::Vector3d as_shown_mm(const Eigen::Vector3d& place_in_ct_mm, const DeformedOrgan* deformed) {
  return deformed != nullptr ? deformed->field.deformed_of(place_in_ct_mm) : place_in_ct_mm;
}

CheckReading check_by_landmarks(const Eigen::Vector3d& tip_in_tracker_mm, const RegisteredPatient& registered,
                                std::span<const NamedPoint> landmarks,
                                const std::vector<Eigen::Vector3d>& markers_in_patient_mm,
                                const DeformedOrgan* deformed) {
  CheckReading reading;
  reading.tip_in_patient_mm = registered.tracker_from_patient.inverse() * tip_in_tracker_mm;
  const auto consider = [&](const std::string& name, const Eigen::Vector3d& place_mm) {
    const double distance_mm = (as_shown_mm(place_mm, deformed) - reading.tip_in_patient_mm).norm();
    if (!reading.nearest.empty() && distance_mm >= reading.distance_mm) return;
    reading.nearest = name;
    reading.nearest_mm = place_mm;
    reading.distance_mm = distance_mm;
    reading.fitted = std::ranges::any_of(registered.fiducials_in_patient_mm, [&](const Eigen::Vector3d& fitted_mm) {
      return (fitted_mm - place_mm).norm() < kSamePlace_mm;
    });
  };
  for (const NamedPoint& landmark : landmarks) consider(landmark.name, landmark.place_mm);
  for (std::size_t i = 0; i < markers_in_patient_mm.size(); ++i)
    consider(words("fiducial_name", i + 1), markers_in_patient_mm[i]);
  return reading;
}

}  // namespace birdseye::host
