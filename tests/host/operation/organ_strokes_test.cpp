// Strokes of the pointer over the organ: what of the tip's way becomes a place of the surface.
#include "host/operation/organ_strokes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace birdseye::host {
namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr int kEvery_ms = 10;

/// A tip that moves in straight lines, measured every 10 ms.
class Tip {
 public:
  Tip(OrganStrokes& strokes, double noise_mm, const Eigen::Vector3d& at_mm = Eigen::Vector3d::Zero())
      : strokes_(strokes), noise_(0, noise_mm), at_mm_(at_mm) {}

  void go_to(const Eigen::Vector3d& to_mm, double pace_mm_s) {
    const int steps = static_cast<int>(std::lround((to_mm - at_mm_).norm() / pace_mm_s * 1000 / kEvery_ms));
    const Eigen::Vector3d from_mm = at_mm_;
    for (int i = 1; i <= steps; ++i) push(from_mm + (to_mm - from_mm) * i / steps);
  }
  void rest_ms(int ms) {
    for (int i = 0; i < ms / kEvery_ms; ++i) push(at_mm_);
  }
  void not_seen_ms(int ms) { time_ms_ += ms; }

 private:
  void push(const Eigen::Vector3d& tip_mm) {
    at_mm_ = tip_mm;
    time_ms_ += kEvery_ms;
    strokes_.take(DeviceTime{time_ms_ * kNsPerMs},
                  tip_mm + Eigen::Vector3d(noise_(random_), noise_(random_), noise_(random_)));
  }
  OrganStrokes& strokes_;
  std::mt19937 random_{5};
  std::normal_distribution<double> noise_;
  Eigen::Vector3d at_mm_;
  std::int64_t time_ms_ = 5000;
};

TEST(OrganStrokes, KeepAPlaceAboutEveryTwoMillimetres) {
  OrganStrokes strokes;
  Tip(strokes, 0).go_to({50, 0, 0}, 40);
  EXPECT_EQ(strokes.places(), 0U) << "no stroke has begun";
  strokes.begin(0);
  Tip tip(strokes, 0);
  tip.go_to({100, 0, 0}, 40);
  EXPECT_EQ(strokes.line(), "stroking: T ends the stroke");
  strokes.end();
  EXPECT_EQ(strokes.line(), "");
  tip.go_to({100, 50, 0}, 40);
  const std::vector<SeenPoint> touches = strokes.touches(0.6);
  EXPECT_GE(touches.size(), 35U);
  EXPECT_LE(touches.size(), 46U);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Eigen::Vector3d& place_mm = touches[i].place_mm;
    EXPECT_LT(place_mm.tail<2>().norm(), 1e-9);
    EXPECT_EQ(touches[i].shift_mm, 0.6);
    EXPECT_FALSE(touches[i].from_camera.has_value()) << "no camera sees it";
    EXPECT_NEAR(touches[i].sigma_mm, 0.5, 1e-6) << "of a touch of which only the pressure is not known";
    if (i == 0) continue;
    EXPECT_NEAR((place_mm - touches[i - 1].place_mm).norm(), 2.4, 0.45);
  }
}

TEST(OrganStrokes, ATipThatRestsIsOnePlace) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip(strokes, 0.5).rest_ms(5000);
  EXPECT_EQ(strokes.places(), 1U);
}

TEST(OrganStrokes, SayHowFarAPlaceMayBeOffByWhatTheTrackerScatters) {
  for (const double noise_mm : {0.5, 2.0}) {
    OrganStrokes strokes;
    strokes.begin(0);
    Tip(strokes, noise_mm).go_to({400, 0, 0}, 40);
    const std::vector<SeenPoint> touches = strokes.touches(0);
    ASSERT_GT(touches.size(), 100U);
    double off_mm2 = 0, expected_mm2 = 0;
    for (const SeenPoint& touch : touches) {
      off_mm2 += touch.place_mm.tail<2>().squaredNorm() / 2 / static_cast<double>(touches.size());
      expected_mm2 += (touch.sigma_mm * touch.sigma_mm - 0.25) / static_cast<double>(touches.size());
    }
    EXPECT_NEAR(std::sqrt(off_mm2), noise_mm / std::sqrt(5.0), 0.15 * noise_mm) << "the mean of five samples";
    EXPECT_NEAR(std::sqrt(expected_mm2), std::sqrt(off_mm2), 0.1 * noise_mm);
  }
}

TEST(OrganStrokes, LeaveOutTheWayToTheOrganAndFromIt) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip tip(strokes, 0.3, {0, 0, 120});
  tip.go_to({0, 0, 0}, 400);
  tip.go_to({40, 0, 0}, 40);
  tip.go_to({40, 0, 80}, 400);
  tip.go_to({40, 60, 80}, 300);
  tip.go_to({40, 60, 0}, 400);
  tip.go_to({80, 60, 0}, 40);
  tip.go_to({80, 60, 30}, 400);  // a short way, to the next line
  tip.go_to({80, 72, 30}, 250);
  tip.go_to({80, 72, 0}, 400);
  tip.go_to({40, 72, 0}, 40);
  tip.go_to({40, 72, 120}, 400);
  strokes.end();
  std::size_t near = 0, far = 0, next = 0;
  for (const SeenPoint& touch : strokes.touches(0)) {
    EXPECT_LT(std::abs(touch.place_mm.z()), 1.5) << touch.place_mm.transpose();
    near += std::abs(touch.place_mm.y()) < 1.5 ? 1 : 0;
    far += std::abs(touch.place_mm.y() - 60) < 1.5 ? 1 : 0;
    next += std::abs(touch.place_mm.y() - 72) < 1.5 ? 1 : 0;
  }
  EXPECT_EQ(near + far + next, strokes.places());
  EXPECT_GT(near, 10U);
  EXPECT_GT(far, 10U);
  EXPECT_GT(next, 10U);
}

TEST(OrganStrokes, LeaveOutWhatIsNotKnownToHaveStayedOnTheOrgan) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip tip(strokes, 0);
  tip.go_to({40, 0, 0}, 40);
  tip.not_seen_ms(150);
  tip.go_to({80, 0, 0}, 40);
  strokes.end();
  bool before = false, after = false;
  for (const SeenPoint& touch : strokes.touches(0)) {
    // In a tenth of a second the tip goes 4 mm.
    EXPECT_FALSE(touch.place_mm.x() > 36.5 && touch.place_mm.x() < 43.5) << touch.place_mm.x();
    before = before || touch.place_mm.x() < 36.5;
    after = after || touch.place_mm.x() > 43.5;
  }
  EXPECT_TRUE(before && after);
}

TEST(OrganStrokes, LeaveOutSamplesThatAreNoneOrComeTwice) {
  OrganStrokes strokes;
  strokes.begin(0);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 200; ++i) {
    const DeviceTime at{(5000 + kEvery_ms * i) * kNsPerMs};
    strokes.take(at, {0.4 * i, 0, 0});
    strokes.take(at, {0.4 * i, 15, 0});
    strokes.take(DeviceTime{at.ns + kNsPerMs}, {kNan, 0, 0});
  }
  EXPECT_GT(strokes.places(), 20U);
  for (const SeenPoint& touch : strokes.touches(0)) EXPECT_LT(touch.place_mm.tail<2>().norm(), 1e-9);
}

TEST(OrganStrokes, KeepNoMorePlacesThanTheMostAndSaySo) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip tip(strokes, 0);
  tip.go_to({800, 0, 0}, 40);
  strokes.end();
  const std::size_t first = strokes.places();
  EXPECT_LT(first, kMostTouchedPlaces);
  strokes.begin(0);
  tip.go_to({2400, 0, 0}, 40);
  EXPECT_EQ(strokes.places(), kMostTouchedPlaces);
  EXPECT_EQ(strokes.line(), "500 places are the most: end the stroke (T)");
  EXPECT_TRUE(strokes.undo(0));
  EXPECT_EQ(strokes.places(), first) << "one of them goes as a whole";
  strokes.begin(0);
  tip.go_to({2420, 0, 0}, 40);
  EXPECT_GT(strokes.places(), first);
}

TEST(OrganStrokes, SayWhereNothingWasTouched) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip(strokes, 0).go_to({300, 0, 0}, 300);
  strokes.end();
  EXPECT_EQ(strokes.places(), 0U);
  EXPECT_EQ(strokes.line(), "nothing was touched: the pointer was not seen, or moved faster than a stroke");
  EXPECT_FALSE(strokes.undo(0)) << "it is none";
}

TEST(OrganStrokes, AreTakenBackAfterTheViewsThatWereKeptLater) {
  OrganStrokes strokes;
  Tip tip(strokes, 0);
  strokes.begin(0);
  tip.go_to({20, 0, 0}, 40);
  strokes.end();
  const std::size_t first = strokes.places();
  strokes.begin(2);
  tip.go_to({40, 0, 0}, 40);
  EXPECT_FALSE(strokes.undo(3)) << "the third view was kept after it began";
  EXPECT_TRUE(strokes.stroking());
  EXPECT_TRUE(strokes.undo(2));
  EXPECT_FALSE(strokes.stroking());
  EXPECT_EQ(strokes.places(), first);
  EXPECT_FALSE(strokes.undo(2));
  EXPECT_FALSE(strokes.undo(1));
  EXPECT_TRUE(strokes.undo(0));
  EXPECT_EQ(strokes.places(), 0U);
  EXPECT_FALSE(strokes.undo(0));
}

TEST(OrganStrokes, AreForgottenWithTheOneThatHasNotEnded) {
  OrganStrokes strokes;
  strokes.begin(0);
  Tip tip(strokes, 0);
  tip.go_to({20, 0, 0}, 40);
  strokes.forget();
  EXPECT_FALSE(strokes.stroking());
  tip.go_to({40, 0, 0}, 40);
  EXPECT_EQ(strokes.places(), 0U);
}

TEST(OrganStrokes, TheShiftOfAllIsTheTipsAndHandEyes) {
  EXPECT_NEAR(tip_shift_mm(0.3, 0.4), std::sqrt(0.09 / 3 + 0.16 / 2), 1e-12);
  EXPECT_NEAR(tip_shift_mm(std::nullopt, std::nullopt), std::sqrt(1 / 3.0 + 1 / 2.0), 1e-12)
      << "what is not known is not 0";
}

}  // namespace
}  // namespace birdseye::host
