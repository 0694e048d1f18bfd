#pragma once

#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_labels.hpp"

namespace birdseye::host {

/// The names that 3D Slicer writes into the header of a segmentation (.seg.nrrd): Segment0_Name and Segment0_LabelValue
/// for the first of its segments. None where the file is no NRRD, or has no segments. Errc::unsupported where segments
/// lie in several layers, for they may overlap. Errc::bad_format where a segment does not say its name or its value, or
/// two of one value differ in name: without names the labels would be taken to be TotalSegmentator's.
Result<std::vector<NamedLabel>> slicer_label_names(const std::filesystem::path& path);

}  // namespace birdseye::host
