#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/label_volume.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Reads a DICOM segmentation (the file, or a folder that holds one), a label volume of any format that import_volume
/// reads, or a folder of masks (is_mask_folder), of which only those that are wanted, where any are; stops as
/// import_volume does. Its voxels must be the CT's, though it may have fewer of them, and its
/// axes another order or direction; an error where they are not, or where it lies outside of the CT.
Result<LabelVolume> import_named_labels(const std::filesystem::path& path, const Volume& ct,
                                        std::span<const LabelChoice> wanted = {}, const std::stop_token& stop = {});
/// Without the names.
Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct, const std::stop_token& stop = {});

/// All values but 0 that voxels have, ascending.
std::vector<std::int16_t> values_in(const Volume& labels);

/// The CT at voxels whose label is one of values and at their 26 neighbours, -1024 HU elsewhere: the neighbours keep
/// the soft edge that partial volume gives an organ. Cut to the box that holds these voxels, so patient_from_voxel
/// differs from ct's. Errc::not_found where no voxel has one of values.
Result<Volume> keep_labels(const Volume& ct, const Volume& labels, std::span<const int> values);

/// The mean position of the voxels with one of these labels, patient LPS mm; Errc::not_found where there are none.
Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, std::span<const int> values);
Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, int value);

}  // namespace birdseye::host
