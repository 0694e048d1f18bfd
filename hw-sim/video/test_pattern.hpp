#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace birdseye::hw_sim {

enum class FrameFormat { rgb3, yuyv, uyvy, nv12, grey };

/// The format with this Video4Linux name: RGB3, YUYV, UYVY, NV12 or GREY.
std::optional<FrameFormat> frame_format_of(std::string_view fourcc);
std::string_view fourcc_of(FrameFormat format);
std::size_t frame_bytes(FrameFormat format, int width_px, int height_px);

/// A test picture that is cheap to move: bars of colour that stay, a white bar that goes round once in two seconds by
/// the time at which each row is exposed, and the frame's number.
///
/// The number: 32 blocks, 16 rows high, along the top, bit 31 at the left; block i has the columns from i * b on, b =
/// the width / 32, rounded down to an even number. A block is white for 1 and black for 0.
class TestPattern {
 public:
  static constexpr int kNumberRows = 16;
  static constexpr double kBarPeriodS = 2;

  /// Width and height even, at least 64.
  TestPattern(FrameFormat format, int width_px, int height_px);

  /// Draws a frame over the one before. Row r is exposed at exposed_s + (r / height - 1 / 2) * readout_s; the left edge
  /// of its bar is at the even column nearest below width * (that time / 2 s, its whole part dropped).
  std::span<const std::uint8_t> draw(std::uint64_t number, double exposed_s, double readout_s);

  [[nodiscard]] FrameFormat format() const { return format_; }
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  void fill(int row, int first, int count, bool white);
  void restore(int row, int first, int count);
  [[nodiscard]] int bar_px() const { return width_px_ / 32 / 2 * 2; }

  FrameFormat format_;
  int width_px_, height_px_;
  std::vector<std::uint8_t> base_, frame_;
  std::vector<int> bar_at_;  ///< of each row in frame_; -1: none yet
};

}  // namespace birdseye::hw_sim
