#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
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

/// Whether a file's voxels may lie in other files beside it, by its name: .mhd, .nhdr, .hdr, .hdr.gz.
bool names_other_files(const std::filesystem::path& file);
/// Whether a file stands for its folder, as the directory of a medium does, by its name: DICOMDIR.
bool stands_for_folder(const std::filesystem::path& file);

/// What a decoder that is given a path may read.
struct Readable {
  std::vector<std::filesystem::path> files;
  std::filesystem::path listed;  ///< the folder whose names it may list, with those of all folders below; empty: none
  std::uintmax_t bytes = 0;      ///< of all files that count as the input
  Duration processor_time;       ///< what they justify in all
};

/// Of a folder, or a file that stands for one: its files and those of all folders below, and where links among them
/// lead. Of a header that names other files: the files in its folder, and in no folder below. Of any other file: that
/// file. Errors: Errc::unsupported: there are too many, in words that go on from the input's name.
Result<Readable> readable_for(const std::filesystem::path& input);

}  // namespace birdseye::host
