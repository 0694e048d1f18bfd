#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// What the simulator knows and only the report reads.
struct SimulatedTruth {
  CameraModel camera;
  Eigen::Vector3d tumour_centre_in_patient_mm;
  std::map<std::uint64_t, Transform<Camera, Patient>> camera_from_patient;  ///< by the frame's sequence
};

/// folder: the simulator's truth/.
Result<SimulatedTruth> read_simulated_truth(const std::filesystem::path& folder);

}  // namespace birdseye::host
