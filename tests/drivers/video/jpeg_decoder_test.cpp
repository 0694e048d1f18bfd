#include "drivers/video/jpeg_decoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "tests/drivers/video/jpeg_pictures.hpp"

namespace birdseye::drivers {
namespace {

constexpr int kWidth = 67, kHeight = 45;

std::vector<std::uint8_t> jpeg(bool progressive = false) {
  return test::encode_jpeg(test::smooth_picture(kWidth, kHeight), kWidth, kHeight, progressive);
}

/// Without its segments of one kind.
std::vector<std::uint8_t> without_segments(const std::vector<std::uint8_t>& in, std::uint8_t marker) {
  std::vector<std::uint8_t> out(in.begin(), in.begin() + 2);
  std::size_t at = 2;
  while (in[at + 1] != 0xda) {
    const std::size_t length = 2U + 256U * in[at + 2] + in[at + 3];
    if (in[at + 1] != marker)
      out.insert(out.end(), in.begin() + static_cast<long>(at), in.begin() + static_cast<long>(at + length));
    at += length;
  }
  out.insert(out.end(), in.begin() + static_cast<long>(at), in.end());
  return out;
}

TEST(JpegDecoder, GivesThePicture) {
  const auto right = test::smooth_picture(kWidth, kHeight);
  std::vector<std::uint8_t> rgb;
  ASSERT_TRUE(decode_jpeg(jpeg(), kWidth, kHeight, rgb));
  ASSERT_EQ(rgb.size(), right.size());
  int worst = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) worst = std::max(worst, std::abs(rgb[i] - right[i]));
  EXPECT_LE(worst, 8);
}

TEST(JpegDecoder, TakesFramesWithoutHuffmanTables) {
  const auto whole = jpeg();
  const auto without = without_segments(whole, 0xc4);
  ASSERT_LT(without.size(), whole.size() - 400);
  std::vector<std::uint8_t> a;
  std::vector<std::uint8_t> b;
  ASSERT_TRUE(decode_jpeg(whole, kWidth, kHeight, a));
  ASSERT_TRUE(decode_jpeg(without, kWidth, kHeight, b));
  EXPECT_EQ(a, b);
}

TEST(JpegDecoder, TakesFramesPaddedAtTheEnd) {
  auto padded = jpeg();
  padded.insert(padded.end() - 2, {0, 0, 0});  // before the mark of the end
  padded.insert(padded.end(), 100, 0);         // and after it
  std::vector<std::uint8_t> rgb;
  EXPECT_TRUE(decode_jpeg(padded, kWidth, kHeight, rgb));
}

TEST(JpegDecoder, RefusesWhatIsCutShort) {
  const auto whole = jpeg();
  std::vector<std::uint8_t> rgb;
  for (std::size_t length = 0; length + 2 < whole.size(); length += length < 700 ? 1 : 17) {
    EXPECT_FALSE(decode_jpeg({whole.data(), length}, kWidth, kHeight, rgb)) << length;
  }
}

TEST(JpegDecoder, RefusesOtherSizesAndKinds) {
  std::vector<std::uint8_t> rgb;
  EXPECT_FALSE(decode_jpeg(jpeg(), kWidth + 1, kHeight, rgb));
  EXPECT_FALSE(decode_jpeg(jpeg(), kWidth, kHeight - 1, rgb));
  EXPECT_FALSE(decode_jpeg(jpeg(true), kWidth, kHeight, rgb));
  EXPECT_FALSE(decode_jpeg(std::vector<std::uint8_t>(1000, 0xff), kWidth, kHeight, rgb));
}

TEST(JpegDecoder, SurvivesDamage) {
  const auto whole = jpeg();
  std::mt19937 random(7);
  std::vector<std::uint8_t> rgb;
  int refused = 0;
  constexpr int kTries = 3000;
  for (int i = 0; i < kTries; ++i) {
    auto damaged = whole;
    for (unsigned n = 1 + random() % 8; n > 0; --n)
      damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
    refused += decode_jpeg(damaged, kWidth, kHeight, rgb) ? 0 : 1;
    ASSERT_EQ(rgb.size(), std::size_t{3} * kWidth * kHeight);
  }
  EXPECT_GT(refused, kTries / 3);  // the rest is a picture with wrong colours, which nothing can tell
  EXPECT_TRUE(decode_jpeg(whole, kWidth, kHeight, rgb));
}

}  // namespace
}  // namespace birdseye::drivers
