#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A structure of a segmentation.
struct NamedLabel {
  int number = 0;           ///< by which its file counts it
  std::string name;         ///< may be empty
  std::vector<int> values;  ///< of its voxels: its number, and those of voxels that it shares with others
};

/// A DICOM segmentation, as labels on the least grid that holds its frames. x fastest; patient frame (LPS), mm.
struct DicomLabels {
  std::array<int, 3> size{};
  Eigen::Vector3d spacing_mm, origin_mm;
  Eigen::Matrix3d axes;  ///< columns: of columns, rows and slices
  std::vector<std::int16_t> labels;
  std::vector<NamedLabel> names;
  std::vector<std::string> series_uids;  ///< of the images that it names as those it is of; may be none
};

/// Reads a segmentation: binary; fractional, of which a voxel belongs where it is at least half full or half sure; or a
/// label map. Frames may be left out and come in any order. Voxels of several segments get values of their own, after
/// the highest number. Only a decoder's process may call this.
Result<DicomLabels> read_dicom_labels(const std::filesystem::path& path);

}  // namespace birdseye::host
