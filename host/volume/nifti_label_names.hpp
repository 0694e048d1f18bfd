#pragma once

#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_labels.hpp"

namespace birdseye::host {

/// The names that a NIfTI file gives its labels in a header extension, as Connectome Workbench and TotalSegmentator
/// write it: <Label Key="5" ...>liver</Label>, the name perhaps within <![CDATA[...]]>. None where it has no such
/// extension. Errc::bad_format where it has one that cannot be read, or that calls a label by two names: without it the
/// labels would be taken to be TotalSegmentator's.
Result<std::vector<NamedLabel>> nifti_label_names(const std::filesystem::path& path);

}  // namespace birdseye::host
