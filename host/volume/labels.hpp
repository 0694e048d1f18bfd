#pragma once

#include <filesystem>
#include <span>
#include <stop_token>

#include "calibration/base/result.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Reads a label volume of any format that import_volume reads, and stops as it does. An error where it is not on the
/// same grid as ct.
Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct, const std::stop_token& stop = {});

/// The CT at voxels whose label is one of values and at their 26 neighbours, -1024 HU elsewhere: the neighbours keep
/// the soft edge that partial volume gives an organ. Cut to the box that holds these voxels, so patient_from_voxel
/// differs from ct's. Errc::not_found where no voxel has one of values.
Result<Volume> keep_labels(const Volume& ct, const Volume& labels, std::span<const int> values);

/// The mean position of the voxels with this label, patient LPS mm; Errc::not_found where there are none.
Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, int value);

}  // namespace birdseye::host
