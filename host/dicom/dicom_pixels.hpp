#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_file.hpp"

namespace birdseye::host {

/// Decodes the pixels of slices. Of a file of many frames it keeps the header from one frame to the next.
class DicomPixels {
 public:
  DicomPixels();
  ~DicomPixels();

  /// Appends the slice's Hounsfield units, rounded, halves away from 0, along rows. path: its file. An error where they
  /// cannot be decoded, or do not fit 16 bits.
  Result<void> append_hu(const std::filesystem::path& path, const DicomSlice& slice, std::vector<std::int16_t>& hu);

 private:
  struct Open;
  std::unique_ptr<Open> open_;
};

}  // namespace birdseye::host
