#include "calibration/picture/field_edge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace birdseye::calibration {
namespace {

constexpr int kWide = 400, kHigh = 300;

struct Drawn {
  RoundField field{{205, 148}, 170};
  double around = 8, light = 120, falls_to = 1;  ///< light at the rim, of that in the middle
  double texture = 30, noise = 4;
  bool dark_bite = false;  ///< dark tissue over a fifth of the rim

  [[nodiscard]] std::vector<std::uint8_t> picture() const {
    std::mt19937 random(4);
    std::normal_distribution<double> normal(0, noise);
    std::vector<std::uint8_t> out;
    for (int y = 0; y < kHigh; ++y) {
      for (int x = 0; x < kWide; ++x) {
        const Eigen::Vector2d from = Eigen::Vector2d(x, y) - field.centre_px;
        const double share = from.norm() / field.radius_px;
        double value = around;
        if (share < 1) {
          value = light * (1 + (falls_to - 1) * share * share) + texture * std::sin(x * 0.11) * std::cos(y * 0.13);
          if (dark_bite && from.x() > 0.8 * field.radius_px) value = around;
        }
        out.push_back(static_cast<std::uint8_t>(std::clamp(value + normal(random), 0.0, 255.0)));
      }
    }
    return out;
  }
};

std::optional<RoundField> found(const Drawn& drawn) {
  const auto pixels = drawn.picture();
  return find_round_field({pixels, kWide, kHigh});
}

FieldSize compared(const Drawn& now, const RoundField& calibrated) {
  const auto pixels = now.picture();
  return compare_round_field({pixels, kWide, kHigh}, calibrated);
}

TEST(FieldEdge, IsFoundToAPercent) {
  Drawn lamp, bitten, off_centre;
  lamp.falls_to = 0.4;
  bitten.dark_bite = true;
  off_centre.field = {{190, 160}, 150};
  for (const Drawn& drawn : {Drawn(), lamp, bitten, off_centre}) {
    const auto field = found(drawn);
    ASSERT_TRUE(field);
    EXPECT_NEAR(field->radius_px, drawn.field.radius_px, 0.01 * drawn.field.radius_px);
    EXPECT_LT((field->centre_px - drawn.field.centre_px).norm(), 0.02 * drawn.field.radius_px);
  }
}

TEST(FieldEdge, APictureWithoutOneShowsNone) {
  Drawn whole, dark;
  whole.field.radius_px = 400;
  dark.light = 12;
  dark.texture = 2;
  EXPECT_FALSE(found(whole));
  EXPECT_FALSE(found(dark));
}

TEST(FieldEdge, PicturesHaveToAgree) {
  const RoundField field{{200, 150}, 170}, other{{200, 150}, 150};
  EXPECT_EQ(agreed_round_field(std::vector{field, field, other}, 3)->radius_px, 170);
  EXPECT_FALSE(agreed_round_field(std::vector{field, field}, 5)) << "most show no edge";
  EXPECT_FALSE(
      agreed_round_field(std::vector{field, other, RoundField{{200, 150}, 130}, RoundField{{200, 150}, 110}}, 4));
  EXPECT_FALSE(agreed_round_field({}, 0));
}

TEST(FieldEdge, AZoomedLensShowsAnother) {
  const RoundField calibrated = Drawn().field;
  for (const double falls_to : {1.0, 0.4}) {
    for (const auto& [zoom, size] : {std::pair{1.0, FieldSize::same},
                                     {1.02, FieldSize::same},
                                     {0.98, FieldSize::same},
                                     {1.1, FieldSize::larger},
                                     {1.3, FieldSize::larger},
                                     {2.5, FieldSize::larger},
                                     {0.9, FieldSize::smaller},
                                     {0.7, FieldSize::smaller}}) {
      Drawn now;
      now.falls_to = falls_to;
      now.field.radius_px *= zoom;
      EXPECT_EQ(compared(now, calibrated), size) << zoom << ", " << falls_to;
    }
  }
}

TEST(FieldEdge, ADarkPictureOrAnEdgeBeyondTheSensorTellsNothing) {
  Drawn dark;
  dark.light = 14;
  dark.texture = 2;
  EXPECT_EQ(compared(dark, Drawn().field), FieldSize::cannot_tell);
  EXPECT_EQ(compared(Drawn(), {{200, 150}, 400}), FieldSize::cannot_tell);
}

TEST(FieldEdge, DarkTissueAtTheRimIsNoZoom) {
  Drawn now;
  now.dark_bite = true;
  EXPECT_EQ(compared(now, Drawn().field), FieldSize::same);
}

}  // namespace
}  // namespace birdseye::calibration
