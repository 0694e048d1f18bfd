#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/record/sha256.hpp"
#include "host/recording/output_file.hpp"

namespace birdseye::host {

/// "scope" -> "ScopeToTracker", as PLUS names transforms: letters and digits, the first a capital. What is named as a
/// transform already, as "StylusToReference", keeps its name.
std::string transform_name(const std::string& bird);
/// 16 numbers, row by row, that read back exactly.
std::string transform_text(const Eigen::Matrix4d& matrix);
/// Seconds with all nine decimals of ns.
std::string seconds_text(std::int64_t ns);

/// A sequence of frames as PLUS and Slicer open it, MetaImage, uncompressed: NAME.igs.mhd with the pixels in NAME.raw,
/// or NAME.igs.mha of poses without pixels. After each frame the file is whole as it stands, whatever ends the program.
class SequenceWriter {
 public:
  using Fields = std::vector<std::pair<std::string, std::string>>;  ///< of a frame, as {"Timestamp", "1.25"}

  /// folder/name.igs.mhd and .raw; of width 0: folder/name.igs.mha without pixels.
  static Result<SequenceWriter> create(const std::filesystem::path& folder, const std::string& name, int width_px,
                                       int height_px);

  /// Adds a frame. rgb: rows from the top; empty where there are no pixels. A frame that cannot be added leaves those
  /// before it as they are.
  Result<void> add(const Fields& fields, std::span<const std::uint8_t> rgb);
  /// Joins header and pixels into one file, NAME.igs.mha, in place of the pair. Meanwhile the disk holds both: where
  /// there is no room the pair stays, and the error says so. Where the pair is not as it was written, it stays too.
  /// Nothing can be added afterwards.
  Result<void> join();
  /// Refuses, naming it, a file that is not where it was written any more, or has another size.
  [[nodiscard]] Result<void> check() const;
  /// The SHA-256 of what was written into each of its files, by name. Refuses a header that was changed meanwhile.
  /// Nothing can be added afterwards.
  Result<std::map<std::string, std::string>> sums();
  /// Brings what was added onto the disk.
  Result<void> sync();
  [[nodiscard]] std::size_t frames() const { return frames_; }
  /// The file to open.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  SequenceWriter(OutputFile header, std::vector<OutputFile> pixels, int width_px, int height_px)
      : path_(header.path()),
        header_(std::move(header)),
        pixels_(std::move(pixels)),
        width_px_(width_px),
        height_px_(height_px) {}
  Result<void> begin();
  [[nodiscard]] std::string count_text() const;
  [[nodiscard]] std::string end_text() const;
  [[nodiscard]] std::uint64_t frame_bytes() const;
  void end_sums();
  /// Gives the header's bytes but for its last line. Refuses, at their end, what is not as it was written.
  Result<void> read_header(const OutputFile::Take& take) const;
  /// The same of the pixels.
  Result<void> read_pixels(const OutputFile::Take& take) const;

  std::filesystem::path path_;
  OutputFile header_;
  std::vector<OutputFile> pixels_;  ///< one, or none
  int width_px_, height_px_;
  std::uint64_t count_at_ = 0, end_at_ = 0;  ///< in the header: where DimSize's value is, and where the next frame goes
  std::size_t frames_ = 0;
  std::string head_;  ///< of the header, as far as DimSize's value, which is written over with each frame
  calibration::Sha256 fields_sum_, pixels_sum_;  ///< of the header behind it, but for its last line; and of the pixels
  std::string fields_sha256_, pixels_sha256_;    ///< once nothing can be added any more
  std::string joined_sha256_;                    ///< empty: it was not joined
};

}  // namespace birdseye::host
