#include "hw-sim/video/post_view.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

namespace birdseye::hw_sim {
namespace {

constexpr int kViewWidth = 320, kViewHeight = 240;

/// Where the scope sees a place of the post or the wall, given by its angle about the axis and its height, with the
/// bird turned by angle_rad: by projection, not by the ray that PostView follows.
Eigen::Vector2d seen_at(double place_rad, double radius_mm, double height_mm, double angle_rad) {
  const double across = place_rad - angle_rad;  // as the bird sees it
  const double depth_mm = PostView::kFromAxisMm - radius_mm * std::cos(across);
  const double focal_px = PostView::kFocalPerWidth * kViewWidth;
  return {kViewWidth / 2.0 + focal_px * radius_mm * std::sin(across) / depth_mm,
          kViewHeight / 2.0 - focal_px * height_mm / depth_mm};
}

/// Between the four pixels about a place.
double red_at(std::span<const std::uint8_t> picture, const Eigen::Vector2d& at) {
  const double left = std::floor(at.x()), above = std::floor(at.y());
  const auto red = [&](double u, double v) {
    return static_cast<double>(picture[3 * (static_cast<std::size_t>(v) * kViewWidth + static_cast<std::size_t>(u))]);
  };
  const double x = at.x() - left, y = at.y() - above;
  return std::lerp(std::lerp(red(left, above), red(left + 1, above), x),
                   std::lerp(red(left, above + 1), red(left + 1, above + 1), x), y);
}

/// What is on the post stays there: the same colours where the scope sees them from another place of its circle, and
/// other ones where it does not.
TEST(PostView, ShowsAPostThatStandsStillWhileTheScopeGoesRound) {
  PostView view(kViewWidth, kViewHeight);
  double together = 0, apart = 0;
  int places = 0;
  for (const double from_rad : {0.0, 1.0, 6.2}) {
    const std::span<const std::uint8_t> drawn = view.draw(from_rad);
    const std::vector<std::uint8_t> first(drawn.begin(), drawn.end());
    const std::span<const std::uint8_t> second = view.draw(from_rad + 0.3);
    for (double place_rad = -0.3; place_rad < 0.6; place_rad += 0.05) {
      for (double height_mm = -25; height_mm <= 25; height_mm += 5) {
        const double place = from_rad + place_rad;
        const Eigen::Vector2d before = seen_at(place, PostView::kPostRadiusMm, height_mm, from_rad);
        const Eigen::Vector2d after = seen_at(place, PostView::kPostRadiusMm, height_mm, from_rad + 0.3);
        together += std::abs(red_at(first, before) - red_at(second, after));
        apart += std::abs(red_at(first, before) - red_at(second, before));
        ++places;
      }
    }
  }
  EXPECT_LT(together / places, 4);
  EXPECT_GT(apart / places, 20);
}

TEST(PostView, ShowsTheWallBesideThePost) {
  PostView view(kViewWidth, kViewHeight);
  const std::span<const std::uint8_t> drawn = view.draw(0);
  const std::vector<std::uint8_t> first(drawn.begin(), drawn.end());
  const std::span<const std::uint8_t> second = view.draw(0.05);
  double together = 0, apart = 0;
  for (const double place_rad : {2.47, 2.49, -2.42, -2.44}) {  // left and right of the post, behind it
    for (double height_mm = -150; height_mm <= 150; height_mm += 12.5) {
      const Eigen::Vector2d before = seen_at(place_rad, PostView::kWallRadiusMm, height_mm, 0);
      const Eigen::Vector2d after = seen_at(place_rad, PostView::kWallRadiusMm, height_mm, 0.05);
      ASSERT_TRUE(std::min(before.x(), after.x()) > 1 && std::max(before.x(), after.x()) < kViewWidth - 2);
      together += std::abs(red_at(first, before) - red_at(second, after));
      apart += std::abs(red_at(first, before) - red_at(second, before));
    }
  }
  EXPECT_LT(together, apart / 5);
}

TEST(PostView, GoesRoundAndRound) {
  PostView view(kViewWidth, kViewHeight);
  const std::span<const std::uint8_t> drawn = view.draw(1.25);
  const std::vector<std::uint8_t> first(drawn.begin(), drawn.end());
  const std::span<const std::uint8_t> again = view.draw(1.25 + 6 * std::numbers::pi);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), again.begin(), again.end()));
}

}  // namespace
}  // namespace birdseye::hw_sim
