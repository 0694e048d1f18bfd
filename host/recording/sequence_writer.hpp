#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::host {

/// A file that is written to its end, whole or with an error that says so; move-only.
class OutputFile {
 public:
  static Result<OutputFile> create(const std::filesystem::path& path);

  /// All of bytes at that place, or what was there before it and why.
  Result<void> put(std::uint64_t at, std::span<const std::uint8_t> bytes);
  Result<void> put(std::uint64_t at, const std::string& text);
  void cut(std::uint64_t bytes);
  /// Appends so many bytes of another file from its beginning on.
  Result<void> append(const std::filesystem::path& other, std::uint64_t at);
  /// Brings what was written onto the disk, so that it is there whatever happens next.
  Result<void> sync();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  OutputFile(UniqueFd fd, std::filesystem::path path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::filesystem::path path_;
};

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
  /// there is no room the pair stays, and the error says so. Nothing can be added afterwards.
  Result<void> join();
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

  std::filesystem::path path_;
  OutputFile header_;
  std::vector<OutputFile> pixels_;  ///< one, or none
  int width_px_, height_px_;
  std::uint64_t count_at_ = 0, end_at_ = 0;  ///< in the header: where DimSize's value is, and where the next frame goes
  std::size_t frames_ = 0;
};

}  // namespace birdseye::host
