#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/child_process.hpp"
#include "drivers/system/part_file.hpp"

namespace birdseye::host {

/// An H.264 film in an MP4 file, encoded by the ffmpeg program. The file appears under its name when the film is whole;
/// of one that does not get there nothing is left.
class Film {
 public:
  static Result<Film> open(const std::filesystem::path& path, int width_px, int height_px, double rate_hz);

  /// rgb: width * height * 3 bytes, rows from the top.
  Result<void> add(std::span<const std::uint8_t> rgb);
  Result<void> finish();

 private:
  Film(PartFile part, ChildProcess encoder, std::size_t frame_bytes)
      : part_(std::move(part)), encoder_(std::move(encoder)), frame_bytes_(frame_bytes) {}
  /// Why, in the encoder's words where it has any.
  [[nodiscard]] Error unfinished() const;

  PartFile part_;
  ChildProcess encoder_;  ///< ends before its file is removed
  std::size_t frame_bytes_;
};

/// The frames of such a film, decoded by the ffmpeg program, in order. The film may come from elsewhere: ffmpeg takes
/// it for nothing but H.264 in an MP4 file, opens nothing besides, and gets memory for frames of the size that is told.
class FilmReader {
 public:
  /// width_px, height_px: the size that whoever recorded it tells of.
  static Result<FilmReader> open(const std::filesystem::path& path, int width_px, int height_px);
  FilmReader(FilmReader&&) noexcept = default;
  FilmReader& operator=(FilmReader&&) noexcept = default;
  ~FilmReader();
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

  /// The frame at index: RGB, rows from the top. Frames before it are passed over. Errc::bad_format: the film ends
  /// before it. Errc::unreadable: there is no picture at all. Errc::bad_value: the pictures are of another size, or the
  /// frame was read or passed over already.
  Result<std::vector<std::uint8_t>> read(std::size_t index);

 private:
  FilmReader(ChildProcess decoder, std::filesystem::path path, int width_px, int height_px)
      : decoder_(std::move(decoder)), path_(std::move(path)), width_px_(width_px), height_px_(height_px) {}
  /// To the pixels of the next frame; false at the film's end.
  Result<bool> take_head();

  ChildProcess decoder_;
  std::filesystem::path path_;
  int width_px_, height_px_;
  std::size_t next_ = 0;
};

}  // namespace birdseye::host
