#pragma once

#include <cstdint>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_tree.hpp"

namespace birdseye::host {

/// The Hounsfield units of all slices, in their order. copies: of how many processes each decodes its share at the same
/// time (docs/decisions/0012-isolated-import.md); with 1, this process decodes all.
Result<std::vector<std::int16_t>> decode_slices(const std::vector<DicomFile>& files,
                                                const std::vector<DicomSlice>& slices, int copies,
                                                const Announce& announce);

}  // namespace birdseye::host
