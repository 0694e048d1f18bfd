#pragma once

#include <filesystem>
#include <span>
#include <stop_token>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/label_volume.hpp"

namespace birdseye::host {

/// Whether it is a folder of NIfTI files: a segmentation of one mask a file, named after what it is of, as
/// TotalSegmentator writes it unless asked for one file.
bool is_mask_folder(const std::filesystem::path& path);

/// What the masks of a folder are of, without values.
std::vector<NamedLabel> mask_names(const std::filesystem::path& folder);

/// The masks that are wanted, by name or number (none named: all), on the grid of the CT; a voxel belongs where it is
/// not 0. A structure of TotalSegmentator 2 has its number, others are counted on from 201 by name; names are told of
/// all. Voxels of several masks get values of their own. Errors name the file.
Result<LabelVolume> import_masks(const std::filesystem::path& folder, const Volume& ct,
                                 std::span<const LabelChoice> wanted, const std::stop_token& stop = {});

}  // namespace birdseye::host
