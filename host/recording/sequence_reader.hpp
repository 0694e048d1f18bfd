#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/files/sequence_header.hpp"

namespace birdseye::host {

/// The pictures of a PLUS sequence (.igs.mha, or .igs.mhd with its pixels beside it), grey or RGB, 8 bits, plain or
/// compressed by zlib, of our making or of PLUS's.
class SequenceReader {
 public:
  /// Refuses, naming the file: what is no such sequence, of other pixels, of more than kMostFramePixels or in an
  /// orientation that is not a picture's.
  static Result<SequenceReader> open(const std::filesystem::path& path);
  SequenceReader(SequenceReader&&) noexcept;
  SequenceReader& operator=(SequenceReader&&) noexcept;
  ~SequenceReader();

  [[nodiscard]] const SequenceHeader& header() const { return header_; }
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }
  /// How many whole frames the file holds: fewer than the header tells of where the file was cut. Of a compressed file
  /// that is known only once read() has come to its end; before, it is what the header tells.
  [[nodiscard]] std::size_t frames() const { return whole_; }

  /// Whether the file has more pixels than the header tells of, by more than one frame that was cut short before it was
  /// told: the header's size, or its channels, are not those of the pixels. Of a compressed file nothing is known.
  [[nodiscard]] bool has_more() const { return more_; }

  /// The frame at index, RGB, rows from the top. In a compressed file all frames before it must be decompressed too,
  /// unless frames are read in order. Errc::bad_format: the file ends before it.
  Result<std::vector<std::uint8_t>> read(std::size_t index);

 private:
  struct Pixels;
  SequenceReader(std::filesystem::path path, SequenceHeader header);
  Result<void> take_layout();
  Result<void> find_pixels();

  std::filesystem::path path_;
  SequenceHeader header_;
  int width_px_ = 0, height_px_ = 0, channels_ = 1;
  bool mirrored_ = false, from_below_ = false;
  std::size_t told_ = 0, whole_ = 0;
  bool more_ = false;
  std::unique_ptr<Pixels> pixels_;
};

}  // namespace birdseye::host
