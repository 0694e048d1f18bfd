#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// What files from elsewhere may cost the process that reads them.
struct Allowance {
  std::uintmax_t memory_bytes = 0;  ///< beside what the process has as it begins
  Duration processor_time;
};

/// Of files of so many bytes in all: memory for three times what Deflate can make of them at most, and processor time
/// to unpack that, and for the slowest decoder, JPEG 2000's.
Allowance allowance_of(std::uintmax_t bytes);

/// What a decoder that is given a path may read.
struct Readable {
  std::vector<std::filesystem::path> paths;  ///< folders with all that is in them, and files
  std::uintmax_t bytes = 0;                  ///< of all files that count as the input
};

/// Of a folder: itself and what its links lead to. Of a file: its own folder, since headers name files beside them; of
/// a header (.mhd, .nhdr, .hdr, .img) what the folder's links lead to besides, and the folder's files count.
Readable readable_for(const std::filesystem::path& input);

}  // namespace birdseye::host
