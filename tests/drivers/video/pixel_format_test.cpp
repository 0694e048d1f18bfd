#include "drivers/video/pixel_format.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>

namespace birdseye::drivers {
namespace {

using Matrix = YuvColour::Matrix;

struct Rgb {
  double r, g, b;
};

/// The recommendations' own equations (BT.601-7, BT.709-6, BT.2020-2), in doubles.
Rgb reference(double y, double u, double v, const YuvColour& colour) {
  const double kr = colour.matrix == Matrix::bt601 ? 0.299 : colour.matrix == Matrix::bt709 ? 0.2126 : 0.2627;
  const double kb = colour.matrix == Matrix::bt601 ? 0.114 : colour.matrix == Matrix::bt709 ? 0.0722 : 0.0593;
  const double luma = colour.full_range ? y / 255 : (y - 16) / 219;
  const double cb = (u - 128) / (colour.full_range ? 255 : 224);
  const double cr = (v - 128) / (colour.full_range ? 255 : 224);
  const double r = luma + 2 * (1 - kr) * cr;
  const double b = luma + 2 * (1 - kb) * cb;
  const double g = (luma - kr * r - kb * b) / (1 - kr - kb);
  const auto byte = [](double x) { return std::clamp(255 * x, 0.0, 255.0); };
  return {byte(r), byte(g), byte(b)};
}

std::vector<std::uint8_t> noise(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

/// Where the luma, u and v of a pixel lie, said a second time and slowly.
Rgb reference_pixel(const std::vector<std::uint8_t>& in, const PixelLayout& l, std::size_t x, std::size_t y) {
  const std::size_t row = y * l.stride;
  switch (l.format) {
    case PixelFormat::yuyv:
      return reference(in[row + 2 * x], in[row + x / 2 * 4 + 1], in[row + x / 2 * 4 + 3], l.colour);
    case PixelFormat::uyvy:
      return reference(in[row + 2 * x + 1], in[row + x / 2 * 4], in[row + x / 2 * 4 + 2], l.colour);
    case PixelFormat::nv12: {
      const std::size_t chroma = l.chroma_offset + y / 2 * l.chroma_stride + x / 2 * 2;
      return reference(in[row + x], in[chroma], in[chroma + 1], l.colour);
    }
    case PixelFormat::grey8:
      return Rgb{1. * in[row + x], 1. * in[row + x], 1. * in[row + x]};
    case PixelFormat::bgr8:
      return Rgb{1. * in[row + 3 * x + 2], 1. * in[row + 3 * x + 1], 1. * in[row + 3 * x]};
    default:
      return Rgb{1. * in[row + 3 * x], 1. * in[row + 3 * x + 1], 1. * in[row + 3 * x + 2]};
  }
}

/// The worst difference over all pixels, in steps of a byte.
double worst_error(const std::vector<std::uint8_t>& in, const PixelLayout& layout) {
  std::vector<std::uint8_t> rgb(7, 99);  // of another size, as a buffer that was used before
  to_rgb(in, layout, rgb);
  const auto width = static_cast<std::size_t>(layout.width_px);
  const auto height = static_cast<std::size_t>(layout.height_px);
  EXPECT_EQ(rgb.size(), 3 * width * height);
  double worst = 0;
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const Rgb right = reference_pixel(in, layout, x, y);
      const std::uint8_t* got = rgb.data() + 3 * (y * width + x);
      worst = std::max({worst, std::abs(got[0] - right.r), std::abs(got[1] - right.g), std::abs(got[2] - right.b)});
    }
  }
  return worst;
}

const std::vector<YuvColour> kColours = {{Matrix::bt601, false}, {Matrix::bt601, true},   {Matrix::bt709, false},
                                         {Matrix::bt709, true},  {Matrix::bt2020, false}, {Matrix::bt2020, true}};

TEST(PixelFormat, EveryLumaAndChromaIsWithinOneOfTheRecommendation) {
  // 256 lumas across, and down every fourth u with every fourth v (and the ends): 8.5 million colours in all.
  std::vector<std::uint8_t> chroma;
  for (int c = 0; c < 256; c += 4) chroma.push_back(static_cast<std::uint8_t>(c));
  chroma.push_back(255);
  for (const YuvColour& colour : kColours) {
    PixelLayout layout = packed_layout(PixelFormat::yuyv, 256, static_cast<int>(chroma.size() * chroma.size()));
    layout.colour = colour;
    std::vector<std::uint8_t> in;
    in.reserve(bytes_needed(layout));
    for (const std::uint8_t u : chroma) {
      for (const std::uint8_t v : chroma) {
        for (unsigned y = 0; y < 256; y += 2) {
          in.insert(in.end(), {static_cast<std::uint8_t>(y), u, static_cast<std::uint8_t>(y + 1), v});
        }
      }
    }
    EXPECT_LE(worst_error(in, layout), 1) << static_cast<int>(colour.matrix) << " full range " << colour.full_range;
  }
}

TEST(PixelFormat, BlackWhiteAndGreyAreExact) {
  for (const YuvColour& colour : kColours) {
    PixelLayout layout = packed_layout(PixelFormat::nv12, 2, 2);
    layout.colour = colour;
    const auto level = [&](std::uint8_t y) {
      std::vector<std::uint8_t> rgb;
      to_rgb(std::vector<std::uint8_t>{y, y, y, y, 128, 128}, layout, rgb);
      EXPECT_EQ(rgb[0], rgb[1]);
      EXPECT_EQ(rgb[1], rgb[2]);
      return int{rgb[0]};
    };
    EXPECT_EQ(level(colour.full_range ? 0 : 16), 0);
    EXPECT_EQ(level(colour.full_range ? 255 : 235), 255);
    EXPECT_EQ(level(0), 0);
    EXPECT_EQ(level(255), 255);
  }
}

/// All widths that end a vector in every way; the last row has no padding to read beyond its end.
TEST(PixelFormat, OddSizesStridesAndPlanes) {
  unsigned seed = 1;
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bgr8, PixelFormat::yuyv, PixelFormat::uyvy,
                                   PixelFormat::nv12, PixelFormat::grey8}) {
    for (int width = 1; width <= 200; width += width < 70 ? 1 : 13) {
      for (const std::size_t padding : {0U, 5U}) {
        PixelLayout layout = packed_layout(format, width, 1 + width % 4);
        layout.stride += padding;
        if (format == PixelFormat::nv12) {
          layout.chroma_offset = layout.stride * static_cast<std::size_t>(layout.height_px) + 3 * padding;
          layout.chroma_stride += 2 * padding;  // another than that of the luma
        }
        const auto in = noise(bytes_needed(layout), ++seed);
        ASSERT_LE(worst_error(in, layout), 1)
            << fourcc_name(fourcc_of(format)) << " width " << width << " padding " << padding;
      }
    }
  }
}

TEST(PixelFormat, NamesAndCodes) {
  for (const char* name : {"RGB3", "BGR3", "YUYV", "UYVY", "NV12", "MJPG", "GREY"}) {
    const auto format = pixel_format_of_name(name);
    ASSERT_TRUE(format) << name;
    EXPECT_EQ(fourcc_name(fourcc_of(*format)), name);
  }
  EXPECT_EQ(pixel_format_of_name("JPEG"), PixelFormat::mjpeg);
  EXPECT_FALSE(pixel_format_of_name("H264"));
  EXPECT_FALSE(pixel_format_of_name("YUY"));
  EXPECT_EQ(fourcc_name(0x01'41'0a'42), "B.A.");
}

TEST(PixelFormat, BytesNeeded) {
  EXPECT_EQ(bytes_needed(packed_layout(PixelFormat::rgb8, 4, 2)), 24U);
  EXPECT_EQ(bytes_needed(packed_layout(PixelFormat::yuyv, 3, 2)), 16U);
  EXPECT_EQ(bytes_needed(packed_layout(PixelFormat::nv12, 4, 2)), 12U);
  EXPECT_EQ(bytes_needed(packed_layout(PixelFormat::nv12, 3, 3)), 9U + 8U);
  PixelLayout padded = packed_layout(PixelFormat::grey8, 10, 3);
  padded.stride = 16;
  EXPECT_EQ(bytes_needed(padded), 42U);
}

}  // namespace
}  // namespace birdseye::drivers
