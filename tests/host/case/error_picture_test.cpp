#include "host/case/error_picture.hpp"

#include <gtest/gtest.h>

#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr int kTile_px = 250;

int brightness(const Picture& picture, int column, int row) {
  const int x = column * kTile_px + kTile_px / 2, y = row * kTile_px + kTile_px / 2;
  const auto at = static_cast<std::size_t>(3 * (y * picture.width_px + x));
  return picture.rgb[at] + picture.rgb[at + 1] + picture.rgb[at + 2];
}

/// 4 mm are to be expected of the half of a ball that faces the patient's back, 0.5 mm of the other.
TEST(ErrorPicture, IsBrightWhereMuchIsUnknown) {
  constexpr double kHere_mm = 40;
  std::vector<SurfacePlace> places;
  for (int i = 0; i < 400; ++i) {
    const double z = 1 - (2.0 * i + 1) / 400, turn = 2.4 * i, around = std::sqrt(1 - z * z);
    const Eigen::Vector3d outwards(around * std::cos(turn), around * std::sin(turn), z);
    places.push_back({kHere_mm * outwards, outwards.y() > 0 ? 4 : 0.5});
  }
  const Picture picture = draw_expected_error(testing::ball(kHere_mm), places, std::nullopt);
  ASSERT_EQ(picture.rgb.size(), static_cast<std::size_t>(3 * picture.width_px * picture.height_px));
  EXPECT_GT(picture.height_px, 2 * kTile_px);
  const int front = brightness(picture, 0, 0), back = brightness(picture, 0, 1);
  EXPECT_GT(back, front + 150);
  // Half of the organ is behind the other one from the left: its picture's right is bright.
  const auto at = [&](int x, int y) {
    return picture.rgb[static_cast<std::size_t>(3 * (y * picture.width_px + x)) + 1];
  };
  EXPECT_GT(at(kTile_px + 180, kTile_px / 2), at(kTile_px + 70, kTile_px / 2) + 60);
}

TEST(ErrorPicture, MarksTheTargetThroughTheOrgan) {
  const std::vector<SurfacePlace> places{{{40, 0, 0}, 1}, {{-40, 0, 0}, 1}, {{0, 40, 0}, 1}, {{0, -40, 0}, 1}};
  const SignedDistance organ = testing::ball(40);
  const Picture without = draw_expected_error(organ, places, std::nullopt);
  const Picture with = draw_expected_error(organ, places, Eigen::Vector3d(0, 10, 0));
  EXPECT_NE(without.rgb, with.rgb);
}

}  // namespace
}  // namespace birdseye::host
