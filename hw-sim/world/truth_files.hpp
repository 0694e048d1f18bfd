#pragma once

#include <Eigen/Core>
#include <filesystem>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "hw-sim/case/deformation.hpp"
#include "hw-sim/world/world.hpp"

namespace birdseye::hw_sim {

/// What the files say besides the world.
struct TruthOfCart {
  CameraModel lens;  ///< at first
  double rate_hz = 25;
  DeformationSettings deformation;
  Eigen::Vector3d tumour_mm;  ///< its centre at first: deformed, where the liver is
};

/// Writes cart.json, what an operator knows, and truth/, what nobody does: truth.json, how everything is at first;
/// frames.csv, the pose of every frame; scene.csv, where the tumour's centre is in the patient and how long the lens
/// is, of every frame.
Result<void> write_truth(const std::filesystem::path& folder, const World& world, const TruthOfCart& truth);

}  // namespace birdseye::hw_sim
