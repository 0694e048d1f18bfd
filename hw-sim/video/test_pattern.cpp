#include "hw-sim/video/test_pattern.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace birdseye::hw_sim {

namespace {

struct NamedFormat {
  std::string_view name;
  FrameFormat format;
};
constexpr std::array<NamedFormat, 5> kFormats{{{"RGB3", FrameFormat::rgb3},
                                               {"YUYV", FrameFormat::yuyv},
                                               {"UYVY", FrameFormat::uyvy},
                                               {"NV12", FrameFormat::nv12},
                                               {"GREY", FrameFormat::grey}}};

struct Rgb {
  std::uint8_t r, g, b;
};
constexpr std::array<Rgb, 8> kBars{{{190, 60, 60},
                                    {170, 110, 60},
                                    {150, 150, 60},
                                    {60, 150, 70},
                                    {60, 140, 150},
                                    {60, 80, 170},
                                    {130, 60, 150},
                                    {110, 110, 110}}};

struct Yuv {
  std::uint8_t y, u, v;
};

/// ITU-R BT.601, limited range.
Yuv yuv_of(const Rgb& c) {
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); };
  return {byte(16 + 0.257 * c.r + 0.504 * c.g + 0.098 * c.b), byte(128 - 0.148 * c.r - 0.291 * c.g + 0.439 * c.b),
          byte(128 + 0.439 * c.r - 0.368 * c.g - 0.071 * c.b)};
}

/// Bytes of one pixel in the first plane.
std::size_t pixel_bytes(FrameFormat format) {
  switch (format) {
    case FrameFormat::rgb3:
      return 3;
    case FrameFormat::yuyv:
    case FrameFormat::uyvy:
      return 2;
    default:
      return 1;
  }
}

/// Two neighbouring pixels of one colour, in the first plane.
void put_pair(FrameFormat format, std::uint8_t* at, const Rgb& colour) {
  const Yuv yuv = yuv_of(colour);
  switch (format) {
    case FrameFormat::rgb3:
      at[0] = at[3] = colour.r;
      at[1] = at[4] = colour.g;
      at[2] = at[5] = colour.b;
      break;
    case FrameFormat::yuyv:
      at[0] = at[2] = yuv.y;
      at[1] = yuv.u;
      at[3] = yuv.v;
      break;
    case FrameFormat::uyvy:
      at[1] = at[3] = yuv.y;
      at[0] = yuv.u;
      at[2] = yuv.v;
      break;
    case FrameFormat::nv12:
      at[0] = at[1] = yuv.y;
      break;
    case FrameFormat::grey:
      at[0] = at[1] = static_cast<std::uint8_t>((colour.r * 2 + colour.g * 5 + colour.b) / 8);
      break;
  }
}

}  // namespace

std::optional<FrameFormat> frame_format_of(std::string_view fourcc) {
  for (const NamedFormat& named : kFormats) {
    if (named.name == fourcc) return named.format;
  }
  return std::nullopt;
}

std::string_view fourcc_of(FrameFormat format) {
  return kFormats[static_cast<std::size_t>(format)].name;
}

std::size_t frame_bytes(FrameFormat format, int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  return format == FrameFormat::nv12 ? pixels + pixels / 2 : pixels * pixel_bytes(format);
}

TestPattern::TestPattern(FrameFormat format, int width_px, int height_px)
    : format_(format),
      width_px_(width_px),
      height_px_(height_px),
      base_(frame_bytes(format, width_px, height_px)),
      bar_at_(static_cast<std::size_t>(height_px), -1) {
  const std::size_t bytes = pixel_bytes(format);
  const auto stride = static_cast<std::size_t>(width_px) * bytes;
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  for (int x = 0; x < width_px; x += 2) {
    const Rgb& colour = kBars[static_cast<std::size_t>(x) * kBars.size() / static_cast<std::size_t>(width_px)];
    put_pair(format, base_.data() + static_cast<std::size_t>(x) * bytes, colour);
    const Yuv yuv = yuv_of(colour);
    for (std::size_t row = 0; format == FrameFormat::nv12 && row < static_cast<std::size_t>(height_px) / 2; ++row) {
      std::uint8_t* const at = base_.data() + pixels + row * stride + x;
      at[0] = yuv.u;
      at[1] = yuv.v;
    }
  }
  for (std::size_t row = 1; row < static_cast<std::size_t>(height_px); ++row) {
    std::memcpy(base_.data() + row * stride, base_.data(), stride);
  }
  frame_ = base_;
}

void TestPattern::fill(int row, int first, int count, bool white) {
  const std::uint8_t level = white ? 255 : 0;
  const std::size_t bytes = pixel_bytes(format_);
  const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(first);
  std::uint8_t* const out = frame_.data() + at * bytes;
  const auto pixels = static_cast<std::size_t>(count);
  if (format_ == FrameFormat::yuyv || format_ == FrameFormat::uyvy) {
    const std::uint8_t luma = white ? 235 : 16;
    for (std::size_t i = 0; i < pixels; ++i) {
      out[2 * i] = format_ == FrameFormat::yuyv ? luma : 128;
      out[2 * i + 1] = format_ == FrameFormat::yuyv ? 128 : luma;
    }
    return;
  }
  const bool limited = format_ == FrameFormat::nv12;
  std::memset(out, limited ? (white ? 235 : 16) : level, pixels * bytes);
  if (!limited || row % 2 != 0) return;
  const auto plane = static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_);
  const auto pair_row = static_cast<std::size_t>(row / 2) * static_cast<std::size_t>(width_px_);
  std::memset(frame_.data() + plane + pair_row + static_cast<std::size_t>(first), 128, pixels);
}

void TestPattern::restore(int row, int first, int count) {
  const std::size_t bytes = pixel_bytes(format_);
  const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(first);
  std::memcpy(frame_.data() + at * bytes, base_.data() + at * bytes, static_cast<std::size_t>(count) * bytes);
  if (format_ != FrameFormat::nv12 || row % 2 != 0) return;
  const auto plane = static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_);
  const auto chroma =
      plane + static_cast<std::size_t>(row / 2) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(first);
  std::memcpy(frame_.data() + chroma, base_.data() + chroma, static_cast<std::size_t>(count));
}

std::span<const std::uint8_t> TestPattern::draw(std::uint64_t number, double exposed_s, double readout_s) {
  for (int row = kNumberRows; row < height_px_; ++row) {
    const double row_s = exposed_s + (static_cast<double>(row) / height_px_ - 0.5) * readout_s;
    const double turns = row_s / kBarPeriodS;
    // The bar is cut off at the right edge rather than carried over, so that each row holds one piece.
    const int at = std::min(static_cast<int>(width_px_ * (turns - std::floor(turns))), width_px_ - 1) / 2 * 2;
    int& was = bar_at_[static_cast<std::size_t>(row)];
    if (was == at) continue;
    if (was >= 0) restore(row, was, std::min(bar_px(), width_px_ - was));
    fill(row, at, std::min(bar_px(), width_px_ - at), true);
    was = at;
  }
  const int block = bar_px();
  for (int row = 0; row < kNumberRows; ++row) {
    for (int bit = 0; bit < 32; ++bit) fill(row, bit * block, block, ((number >> (31 - bit)) & 1U) != 0);
  }
  return frame_;
}

}  // namespace birdseye::hw_sim
