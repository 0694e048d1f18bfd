#pragma once

#include <filesystem>
#include <vector>

#include "host/dicom/dicom_labels.hpp"

namespace birdseye::host {

/// The names that a NIfTI file gives its labels in a header extension, as Connectome Workbench and TotalSegmentator
/// write it: <Label Key="5" ...>liver</Label>, the name perhaps within <![CDATA[...]]>. None where it has no such
/// extension.
std::vector<NamedLabel> nifti_label_names(const std::filesystem::path& path);

}  // namespace birdseye::host
