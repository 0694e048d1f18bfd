#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/process_copy.hpp"
#include "host/dicom/dicom_tree.hpp"

namespace birdseye::host {

/// The Hounsfield units of all slices, in their order. copies: of the decoder's process, each of which does send_slices
/// and decodes its share at the same time (docs/decisions/0012-isolated-import.md); with fewer than two, this process
/// decodes all.
Result<std::vector<std::int16_t>> decode_slices(const std::vector<DicomFile>& files,
                                                const std::vector<DicomSlice>& slices, std::span<ProcessCopy> copies,
                                                const Announce& announce);

/// In a copy: sends the Hounsfield units of each slice that decode_slices gives it.
void send_slices(const ProcessCopy::Take& take, const ProcessCopy::Send& send);

}  // namespace birdseye::host
