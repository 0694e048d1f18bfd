#include "host/app/registration_error.hpp"

#include <algorithm>

namespace birdseye::host {

namespace {

/// Where a point of the organ at rest is now: x with x + u(x) = rest, by fixed-point steps.
Eigen::Vector3d deformed(const DisplacementField& field, const Eigen::Vector3d& rest_mm) {
  Eigen::Vector3d x = rest_mm;
  constexpr int kSteps = 200;
  constexpr double kClose_mm = 1e-4;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d change = 0.7 * (rest_mm - field.displacement(x) - x);
    x += change;
    if (change.norm() < kClose_mm) break;
  }
  return x;
}

}  // namespace

std::optional<TargetError> target_error(const std::vector<Landmark>& landmarks, const std::string& prefix,
                                        const DisplacementField* field,
                                        const Transform<Patient, Patient>& model_from_found) {
  TargetError error;
  int count = 0;
  for (const Landmark& landmark : landmarks) {
    if (landmark.name.rfind(prefix, 0) != 0) continue;
    const Eigen::Vector3d now = field != nullptr ? deformed(*field, landmark.rest_mm) : landmark.rest_mm;
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
