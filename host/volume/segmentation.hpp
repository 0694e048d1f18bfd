#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>

#include "calibration/base/result.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What belongs to an organ: voxels with HU of [low_hu, high_hu]; with a seed, those connected to it by faces; with
/// largest, the largest connected part of them.
struct SegmentationSettings {
  int low_hu = 0, high_hu = 0;
  std::optional<Eigen::Vector3d> seed_in_patient_mm;
  bool largest = false;
};

/// 1 where the organ is, 0 elsewhere, on the CT's grid. Errc::bad_value for an empty range or a seed that is outside of
/// the volume or of the range; Errc::not_found where no voxel belongs.
Result<Volume> segment(const Volume& ct, const SegmentationSettings& settings);

/// As a compressed image that import_labels reads back: .nii.gz, .nrrd or .mha.
Result<void> write_labels(const std::filesystem::path& path, const Volume& labels);

}  // namespace birdseye::host
