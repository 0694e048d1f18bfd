#pragma once

#include <filesystem>
#include <span>

#include "calibration/base/result.hpp"
#include "drivers/system/process_copy.hpp"
#include "host/dicom/dicom_tree.hpp"
#include "host/dicom/refused.hpp"
#include "host/dicom/series.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/stated_geometry.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

// Only a decoder's process may call these (decoder_process.hpp): a decoder may end its process on a damaged file.

/// What a folder of DICOM files, or one of them, holds.
struct DicomScan {
  DicomTree tree;
  std::vector<Series> series;
};
/// A directory file stands for its folder where it is named so (stands_for_folder). Errc::not_found where there is no
/// DICOM file.
Result<DicomScan> scan_dicom(const VolumeSource& source, const Announce& announce);
/// copies: processes that may decode at the same time, each of which does send_slices.
Result<ImageFile> decode_dicom(const VolumeSource& source, const Announce& announce, std::span<ProcessCopy> copies);
/// A DICOM segmentation, a folder that holds one, or a series whose values are labels.
Result<ImageFile> decode_dicom_labels(const std::filesystem::path& path, const Announce& announce,
                                      std::span<ProcessCopy> copies);
Result<ImageFile> decode_image_file(const VolumeSource& source, int components, GeometryFrom from);

}  // namespace birdseye::host
