#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

struct PhantomSettings {
  std::filesystem::path folder;
  std::uint64_t seed = 1;
  std::filesystem::path ct;      ///< a CT to build on, or empty for the procedural body
  std::filesystem::path labels;  ///< its organ labels, or empty to find the liver
  int liver_label = 5;           ///< the liver's value in labels
};

/// Writes folder/ct (DICOM series), folder/segmentation.nii.gz, folder/surfaces/*.ply and folder/truth.json, and lists
/// the files in folder/birdseye-sim-phantom.json. The same settings give the same bytes. A folder/ct that is not empty
/// is refused, and so is a file that has one of these names, but where a phantom was written before, or the beginning
/// of one.
Result<void> write_phantom(const PhantomSettings& settings);

/// What folder/truth.json says, patient LPS mm.
struct PhantomTruth {
  Eigen::Vector3d liver_centre_mm, tumour_centre_mm;
  std::vector<Eigen::Vector3d> fiducials_mm;
};
Result<PhantomTruth> read_phantom_truth(const std::filesystem::path& folder);

}  // namespace birdseye::hw_sim
