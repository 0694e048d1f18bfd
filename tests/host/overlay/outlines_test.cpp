// Outlines, holes and margins: what a picture keeps of the drawn, and where.
#include "host/overlay/outlines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "host/overlay/hole.hpp"

namespace birdseye::host {
namespace {

constexpr int kWide = 320, kHigh = 240;
constexpr double kLineWide_px = 1 + 1.5;  // a 220th of the height, and a pixel's own extent

using Rgba = std::array<std::uint8_t, 4>;

ImageRgba picture_of(const std::function<Rgba(int, int)>& pixel) {
  ImageRgba out{kWide, kHigh, {}};
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const Rgba rgba = pixel(x, y);
      out.rgba.insert(out.rgba.end(), rgba.begin(), rgba.end());
    }
  }
  return out;
}

Rgba pixel_of(const ImageRgba& image, int x, int y) {
  Rgba out{};
  std::copy_n(&image.rgba[4 * (static_cast<std::size_t>(y) * kWide + static_cast<std::size_t>(x))], 4, out.begin());
  return out;
}

double from_middle_px(int x, int y) {
  return std::hypot(x - 0.5 * (kWide - 1), y - 0.5 * (kHigh - 1));
}

/// A disc of one colour, darker towards its rim as a shaded ball is.
ImageRgba ball(double radius_px, double shading) {
  return picture_of([=](int x, int y) -> Rgba {
    const double r = from_middle_px(x, y);
    if (r > radius_px) return {};
    const double light = 1 - shading * r / radius_px;
    return {static_cast<std::uint8_t>(std::lround(200 * light)), static_cast<std::uint8_t>(std::lround(100 * light)),
            static_cast<std::uint8_t>(std::lround(50 * light)), 255};
  });
}

TEST(Outlines, AreWhereSomethingBeginsAndWithinIt) {
  const ImageRgba lines = outlines_of(ball(70, 0));
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const double inwards_px = 70 - from_middle_px(x, y);
      const Rgba pixel = pixel_of(lines, x, y);
      if (inwards_px > 0 && inwards_px < 0.65) {
        EXPECT_EQ(pixel[3], 255) << x << " " << y;
        EXPECT_EQ(pixel[0], 255) << "as bright as its colour can be";
        EXPECT_NEAR(pixel[1], 127, 1);
      }
      if (std::abs(inwards_px) > kLineWide_px + 1.5) {
        EXPECT_EQ(pixel[3], 0) << x << " " << y;
      }
      if (inwards_px < 0) {
        EXPECT_EQ(pixel[0], 0) << "what is outside is the dark edge at most";
      }
    }
  }
}

TEST(Outlines, DoNotFollowShading) {
  EXPECT_EQ(outlines_of(ball(70, 0.6)).rgba.size(), ball(70, 0.6).rgba.size());
  const ImageRgba flat = outlines_of(ball(70, 0)), shaded = outlines_of(ball(70, 0.6));
  for (std::size_t i = 3; i < flat.rgba.size(); i += 4) ASSERT_EQ(flat.rgba[i], shaded.rgba[i]) << i / 4;
}

TEST(Outlines, AreWhereAnotherColourBegins) {
  const ImageRgba lines = outlines_of(picture_of([](int x, int /*y*/) -> Rgba {
    return x < 160 ? Rgba{120, 60, 200, 255} : Rgba{60, 200, 120, 255};
  }));
  for (int y = 10; y < kHigh - 10; ++y) {
    int drawn = 0;
    for (int x = 150; x < 170; ++x) drawn += pixel_of(lines, x, y)[3] == 255 ? 1 : 0;
    EXPECT_GE(drawn, 1) << y;
    EXPECT_LE(drawn, 3) << y;
    EXPECT_EQ(pixel_of(lines, 100, y)[3], 0);
    EXPECT_EQ(pixel_of(lines, 220, y)[3], 0);
  }
  // The picture's border is no outline: what it cuts off goes on.
  EXPECT_EQ(pixel_of(lines, 0, 100)[3], 0);
}

TEST(Outlines, AHazeHasNone) {
  for (const std::uint8_t value : outlines_of(picture_of([](int, int) { return Rgba{10, 5, 5, 30}; })).rgba)
    ASSERT_EQ(value, 0);
  EXPECT_TRUE(outlines_of({}).rgba.empty());
}

TEST(Hole, ShowsNothingOutsideAndDarkensInside) {
  const ImageRgba hole = in_hole(picture_of([](int, int) { return Rgba{50, 100, 20, 128}; }), 0.3);
  for (int y = 0; y < kHigh; ++y) {
    for (int x = 0; x < kWide; ++x) {
      const double r = from_middle_px(x, y);
      const Rgba pixel = pixel_of(hole, x, y);
      if (r > 0.3 * kHigh) {
        EXPECT_EQ(pixel, Rgba{}) << x << " " << y;
      } else if (r < 0.3 * kHigh - 2) {
        EXPECT_EQ(pixel[1], 100) << "the overlay's own colours stay";
        EXPECT_GT(pixel[3], 190) << "and hide more of the video";
        EXPECT_LT(pixel[3], 255);
      }
    }
  }
  // Darker at the wall than in the middle.
  EXPECT_GT(pixel_of(hole, kWide / 2 + 66, kHigh / 2)[3], pixel_of(hole, kWide / 2, kHigh / 2)[3] + 10);
}

TEST(Hole, StaysPremultiplied) {
  const ImageRgba hole = in_hole(ball(100, 0.5), 0.45);
  for (std::size_t i = 0; i < hole.rgba.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) ASSERT_LE(hole.rgba[i + c], hole.rgba[i + 3]);
  }
}

}  // namespace
}  // namespace birdseye::host
