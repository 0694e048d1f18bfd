#include "host/overlay/surface_cues.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace birdseye::host {
namespace {

constexpr int kWidth = 120, kHeight = 90;

/// The cues of a grey picture.
std::vector<std::uint8_t> cues_of(const std::function<int(int, int)>& level) {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) rgb.insert(rgb.end(), 3, static_cast<std::uint8_t>(level(x, y)));
  }
  return surface_cues({rgb, kWidth, kHeight});
}

std::uint8_t at(const std::vector<std::uint8_t>& cues, int x, int y) {
  return cues[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)];
}

TEST(SurfaceCues, OfAnEvenSurfaceAreNone) {
  for (const std::uint8_t cue : cues_of([](int, int) { return 120; })) EXPECT_EQ(cue, 0);
  // Nor of the lamp's slow fall towards the rim.
  for (const std::uint8_t cue : cues_of([](int x, int) { return 60 + x; })) EXPECT_EQ(cue, 0);
}

TEST(SurfaceCues, StandAtEdgesAndHighlights) {
  const auto cues = cues_of([](int x, int y) {
    if (x > 80 && y > 60) return 250;
    return x < 40 ? 90 : 150;
  });
  EXPECT_GT(at(cues, 40, 20), 100) << "an edge";
  EXPECT_EQ(at(cues, 20, 20), 0);
  EXPECT_EQ(at(cues, 60, 20), 0);
  EXPECT_GT(at(cues, 100, 75), 200) << "within a highlight";
}

TEST(SurfaceCues, OfAPictureOfAnotherSizeAreNone) {
  EXPECT_TRUE(surface_cues({std::vector<std::uint8_t>(30), kWidth, kHeight}).empty());
}

}  // namespace
}  // namespace birdseye::host
