#pragma once

#include <Eigen/Core>

#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The least box along the patient's axes that holds the centres of a volume's voxels; patient LPS, mm.
struct PatientBox {
  Eigen::Vector3d low_mm, high_mm;
  [[nodiscard]] Eigen::Vector3d middle_mm() const { return 0.5 * (low_mm + high_mm); }
};
PatientBox patient_box(const Volume& volume);

}  // namespace birdseye::host
