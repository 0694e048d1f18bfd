#include "drivers/minibird/bird_guard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "calibration/geometry/transform.hpp"
#include "tests/drivers/minibird/wire_records.hpp"

namespace birdseye::drivers::minibird {
namespace {

using birdseye::testing::wire_record;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kPeriodS = 0.01;

/// A guard and the time. Readings carry noise, as a real sensor's do, unless told otherwise.
class Watch {
 public:
  explicit Watch(const Plausibility& limits = {}, Hemisphere hemisphere = Hemisphere::forward)
      : guard_({RecordFormat::position_matrix, kMmPerCount36Inch, into(hemisphere)}, limits) {}

  BirdReading see(const Vector3d& position_mm, const Matrix3d& rotation = Matrix3d::Identity(), double noise_mm = 0.3) {
    std::normal_distribution<double> noise(0, noise_mm);
    Vector3d noisy = position_mm;
    if (noise_mm > 0) noisy += Vector3d(noise(random_), noise(random_), noise(random_));
    const Bytes bytes = wire_record(noisy, rotation);
    Record record;
    for (std::size_t i = 0; i < bytes.size(); i += 2) record.words.push_back(decode_word(bytes[i], bytes[i + 1]));
    return see(record);
  }
  BirdReading see(const Record& record) {
    seconds += kPeriodS;
    return guard_.judge(record, {static_cast<std::int64_t>(seconds * 1e9)}, Duration{200'000}, time_certain);
  }
  /// So many readings at a place; how many of them have a pose.
  int see_often(int count, const Vector3d& position_mm) {
    int poses = 0;
    for (int i = 0; i < count; ++i) poses += see(position_mm).pose ? 1 : 0;
    return poses;
  }

  [[nodiscard]] const BirdGuard::Noise& noise() const { return guard_.noise(); }
  void expect(const BirdGuard::Noise& noise) { guard_.expect(noise); }

  double seconds = 0;
  bool time_certain = true;

 private:
  BirdGuard guard_;
  std::mt19937 random_{7};
};

const Vector3d kHere(300, 80, -40);

TEST(BirdGuard, TheFirstReadingsAreConfirmedByTheNext) {
  Watch watch;
  const BirdReading first = watch.see(kHere);
  EXPECT_EQ(first.kind, DoubtKind::unconfirmed);
  EXPECT_FALSE(first.pose);
  EXPECT_THAT(first.doubt, HasSubstr("not yet confirmed"));
  EXPECT_EQ(watch.see_often(2, kHere), 0);
  const BirdReading fourth = watch.see(kHere);
  EXPECT_TRUE(fourth.pose);
  EXPECT_EQ(fourth.doubt, "");
  EXPECT_EQ(watch.see_often(1000, kHere), 1000);
}

TEST(BirdGuard, TimesThatAreNotCertainMakeNoTrack) {
  Watch watch;
  const auto moving = [](double s) { return Vector3d(300 + 400 * s, 80, -40); };
  double now = 0;
  const auto see = [&](double by_s) { return watch.see(moving(now += by_s)); };
  for (int i = 0; i < 20; ++i) see(kPeriodS);
  // Measurements are lost and their times not counted: for a while readings seem to come twice as fast.
  watch.time_certain = false;
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(see(i == 0 ? 3 * kPeriodS : kPeriodS).pose) << i;
  // Now they are counted.
  watch.time_certain = true;
  watch.seconds += 2 * kPeriodS;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(see(kPeriodS).pose) << i;
}

TEST(BirdGuard, AHandThatMovesIsNotDoubted) {
  // Up to 1.2 m/s and 18 m/s^2, with noise as at the edge of the tracker's range.
  Watch watch;
  watch.see({400, 0, 0});
  int doubted = 0;
  for (int i = 1; i < 4000; ++i) {
    const double s = i * kPeriodS;
    const BirdReading reading =
        watch.see(Vector3d(400 + 80 * std::sin(15 * s), 80 * std::cos(15 * s) - 80, 50 * s / 40),
                  rotation_exp(Vector3d(0, 0, 1.5 * std::sin(4 * s))), 1.0);
    doubted += reading.pose ? 0 : 1;
  }
  EXPECT_LE(doubted, 4);
}

TEST(BirdGuard, ASingleWildReadingIsDoubtedAndTheStreamGoesOn) {
  Watch watch;
  watch.see_often(20, kHere);
  const BirdReading wild = watch.see(kHere + Vector3d(0, 60, 0));
  EXPECT_EQ(wild.kind, DoubtKind::step);
  EXPECT_THAT(wild.doubt, HasSubstr("a step of 60 mm"));
  EXPECT_EQ(watch.see_often(100, kHere), 100);
  EXPECT_EQ(watch.see(kHere, rotation_exp(Vector3d(0.8, 0, 0))).kind, DoubtKind::step);
  EXPECT_EQ(watch.see_often(100, kHere), 100);
}

TEST(BirdGuard, DamagedRecordsBetweenThoseOfAFrozenBirdAreNoSignOfLife) {
  Watch watch;
  watch.see_often(1000, kHere);
  watch.see(kHere, Matrix3d::Identity(), 0);
  for (int i = 0; i < 4; ++i) watch.see(kHere, Matrix3d::Identity(), 0);
  std::mt19937 random(3);
  int poses = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool damaged = random() % 3 == 0;
    const Vector3d told = kHere + Vector3d(damaged ? 0.1 * static_cast<double>(1 + random() % 30) : 0, 0, 0);
    poses += watch.see(told, Matrix3d::Identity(), 0).pose ? 1 : 0;
  }
  EXPECT_LE(poses, 100) << "of some 660 that differ from the frozen one";
  EXPECT_LT(watch.see_often(60, kHere), 60);
  EXPECT_EQ(watch.see_often(100, kHere), 100);
}

TEST(BirdGuard, AfterLostRecordsAReadingFarOffTheTrackIsConfirmedByTheNext) {
  Watch watch;
  watch.see_often(100, kHere);
  watch.seconds += 2 * kPeriodS;  // two records are lost
  EXPECT_FALSE(watch.see(kHere + Vector3d(35, 0, 0)).pose) << "a hand might have moved so far, a damaged byte may too";
  EXPECT_TRUE(watch.see(kHere).pose);
  watch.see_often(100, kHere);
  watch.seconds += 2 * kPeriodS;
  EXPECT_FALSE(watch.see(kHere + Vector3d(35, 0, 0)).pose);
  EXPECT_TRUE(watch.see(kHere + Vector3d(40, 0, 0)).pose);
}

TEST(BirdGuard, BetweenReadingsThatMakeNoSenseNoneIsBelieved) {
  Watch watch;
  watch.see_often(100, kHere);
  int between = 0;
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(watch.see(kHere + Vector3d(0, 60, 0)).pose);
    between += watch.see_often(2, kHere);
  }
  EXPECT_LE(between, 6) << "once three of them have come none is believed";
  EXPECT_EQ(watch.see(kHere).kind, DoubtKind::line_noise);
  EXPECT_LT(watch.see_often(60, kHere), 60);
  EXPECT_EQ(watch.see_often(100, kHere), 100) << "the line is sound again";
  // One now and then is none of a line that is damaged.
  for (int i = 0; i < 50; ++i) {
    watch.see(kHere + Vector3d(0, 60, 0));
    EXPECT_EQ(watch.see_often(30, kHere), 30);
  }
}

TEST(BirdGuard, AStepThatStaysIsBelievedAfterAWhile) {
  Watch watch;
  watch.see_often(20, kHere);
  const Vector3d there = kHere + Vector3d(0, 200, 0);
  EXPECT_EQ(watch.see_often(5, there), 0);
  EXPECT_EQ(watch.see_often(100, there), 100);
}

TEST(BirdGuard, StepsThatDoNotAgreeAreNeverBelieved) {
  Watch watch;
  watch.see_often(20, kHere);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-300, 300);
  for (int i = 0; i < 40; ++i) {
    const BirdReading reading = watch.see({500 + anywhere(random), anywhere(random) + 500, anywhere(random)});
    EXPECT_FALSE(reading.pose);
  }
  // So long, that the first is to be confirmed.
  EXPECT_EQ(watch.see_often(50, kHere), 49);
}

TEST(BirdGuard, AfterAGapTheSensorMayBeElsewhere) {
  Watch watch;
  watch.see_often(20, kHere);
  watch.seconds += 3;
  EXPECT_EQ(watch.see({350, -200, 300}).kind, DoubtKind::unconfirmed);
  EXPECT_EQ(watch.see_often(100, {350, -200, 300}), 100);
}

TEST(BirdGuard, SaturationAndTheEndOfTheScaleAreNamed) {
  Watch watch;
  watch.see_often(20, kHere);
  const BirdReading zero = watch.see(kHere, Matrix3d::Zero());
  EXPECT_EQ(zero.kind, DoubtKind::saturated);
  EXPECT_THAT(zero.doubt, HasSubstr("saturated"));
  const BirdReading far = watch.see({kHere.x(), 914.4, 0});
  EXPECT_EQ(far.kind, DoubtKind::beyond_scale);
  EXPECT_THAT(far.doubt, HasSubstr("914 mm"));
  EXPECT_EQ(watch.see({kHere.x(), -914.4, 0}, Matrix3d::Identity(), 0).kind, DoubtKind::beyond_scale);
  EXPECT_EQ(watch.see(kHere, 0.97 * Matrix3d::Identity()).kind, DoubtKind::senseless);
  EXPECT_EQ(watch.see_often(50, kHere), 50);
}

TEST(BirdGuard, ARecordThatRepeatsWhereThereWasNoiseIsFrozen) {
  Watch watch;
  for (int i = 0; i < 20; ++i) watch.see(kHere + Vector3d(0, 0.5 * i - 10, 0));
  for (int i = 0; i < 60; ++i) watch.see(kHere, Matrix3d::Identity(), 0.03);  // a count, now and then the same record
  const Vector3d beside = kHere + Vector3d(0.4, 0, 0);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(watch.see(beside, Matrix3d::Identity(), 0).pose) << i;
  const BirdReading frozen = watch.see(beside, Matrix3d::Identity(), 0);
  EXPECT_EQ(frozen.kind, DoubtKind::frozen);
  EXPECT_THAT(frozen.doubt, HasSubstr("101 times"));
  for (int i = 0; i < 200; ++i) EXPECT_EQ(watch.see(beside, Matrix3d::Identity(), 0).kind, DoubtKind::frozen);
  watch.see(kHere);
  watch.see_often(5, kHere);  // of a bird that was frozen more is asked
  EXPECT_EQ(watch.see_often(10, kHere), 10);
}

TEST(BirdGuard, WhereTheNoiseWasPlainItIsFrozenAfterAFewRecords) {
  Watch watch;
  watch.see_often(60, kHere);
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(watch.see(kHere, Matrix3d::Identity(), 0).pose) << i;
  EXPECT_EQ(watch.see(kHere, Matrix3d::Identity(), 0).kind, DoubtKind::frozen);
}

/// The unit was powered off and on: the sensor's noise is what it was.
TEST(BirdGuard, ANewStreamThatRepeatsItselfFromTheStartIsFrozenWhereTheOneBeforeHadNoise) {
  Watch before, after;
  before.see_often(60, kHere);
  after.expect(before.noise());
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(after.see(kHere, Matrix3d::Identity(), 0).pose) << i;
  EXPECT_EQ(after.see(kHere, Matrix3d::Identity(), 0).kind, DoubtKind::frozen);
  after.see(kHere);
  after.see_often(48, kHere);  // of the last 64 no more than a quarter are alike
  EXPECT_EQ(after.see_often(10, kHere), 10);
}

/// Of a bird whose records often repeat, a repeated one says nothing of itself.
TEST(BirdGuard, ABirdThatIsFrozenAsItsUnitStartsAgainHasNoPose) {
  Watch before, after;
  for (int i = 0; i < 200; ++i) before.see(kHere + Vector3d(0.1 * (i / 3 % 5), 0, 0), Matrix3d::Identity(), 0);
  ASSERT_TRUE(before.see(kHere, Matrix3d::Identity(), 0).pose);
  after.expect(before.noise());
  for (int i = 0; i < 300; ++i) EXPECT_FALSE(after.see(kHere, Matrix3d::Identity(), 0).pose) << i;
}

/// The bird froze before birdseyed started.
TEST(BirdGuard, WhatHasRepeatedItselfSinceTheStartHasNoPose) {
  Watch watch;
  for (int i = 0; i < 1000; ++i) {
    const bool damaged = i % 40 == 20;  // by less than shows
    const BirdReading reading = watch.see(kHere + Vector3d(damaged ? 1 + i % 7 : 0, 0, 0), Matrix3d::Identity(), 0);
    EXPECT_FALSE(reading.pose) << i;
    if (damaged) continue;
    EXPECT_EQ(reading.kind, i < 15 ? DoubtKind::unconfirmed : DoubtKind::frozen) << i;
  }
  watch.see_often(48, kHere);  // of the last 64 no more than a quarter are alike
  EXPECT_EQ(watch.see_often(10, kHere), 10);

  Plausibility may_repeat;
  may_repeat.frozen_after = 0;
  Watch still(may_repeat);
  still.see(kHere, Matrix3d::Identity(), 0);
  EXPECT_TRUE(still.see(kHere, Matrix3d::Identity(), 0).pose);
}

/// By less than shows, of one damaged record in three. In the first records such may pass for life, until more have
/// come.
TEST(BirdGuard, WhatIsFrozenSinceTheStartShowsNoLifeByHalfOfItsRecordsDamaged) {
  int early = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> half(0, 1), axis(0, 2), bit(4, 14);
    Watch watch;
    for (int i = 0; i < 500; ++i) {
      Vector3d told = kHere;
      if (half(random) != 0) told(axis(random)) += kMmPerCount36Inch * (1 << bit(random));
      if (told.norm() > 900) continue;
      const bool believed = watch.see(told, Matrix3d::Identity(), 0).pose.has_value();
      early += i < 40 && believed ? 1 : 0;
      EXPECT_TRUE(i < 40 || !believed) << seed << ", " << i;
    }
  }
  EXPECT_LT(early, 200 * 40 / 100);
}

TEST(BirdGuard, AQuietSensorThatRestsSinceTheStartIsAlive) {
  Watch watch;
  for (int i = 0; i < 64; ++i) watch.see(kHere, Matrix3d::Identity(), 0.03);
  EXPECT_TRUE(watch.see(kHere, Matrix3d::Identity(), 0.03).pose);
}

TEST(BirdGuard, AHandIsAsFastAtASlowRate) {
  Watch watch;
  for (int i = 0; i < 100; ++i) {
    watch.seconds += 1.0 / 14 - kPeriodS;
    const bool believed = watch.see(kHere + Vector3d(0, 60 * std::sin(8 * watch.seconds), 0)).pose.has_value();
    EXPECT_TRUE(i < 8 || believed) << i;
  }
}

TEST(BirdGuard, WhereverASensorMayHaveComeInAGapOneReadingAloneIsNotBelieved) {
  Watch watch;
  watch.see_often(60, kHere);
  watch.time_certain = false;
  watch.see_often(20, kHere);
  watch.time_certain = true;
  watch.seconds += 0.1;
  EXPECT_FALSE(watch.see(kHere + Vector3d(0, 0, 200)).pose);
  watch.see_often(2, kHere);
  EXPECT_EQ(watch.see_often(20, kHere), 20);
}

TEST(BirdGuard, WhereThereNeverWasNoiseARepeatedRecordIsASensorAtRestOnceItHasMoved) {
  Watch watch;
  const auto see = [&watch](double y) { return watch.see({300, y, -40}, Matrix3d::Identity(), 0); };
  for (int i = 16; i >= 0; --i) see(0.12 * i);
  for (int i = 0; i < 1000; ++i) {
    const BirdReading reading = see(0);
    ASSERT_TRUE(reading.pose) << i << reading.doubt;
  }
  // It starts, gently, and comes to rest again.
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(see(50 - 50 * std::cos(i * 3.14159265 / 400)).pose) << i;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(see(100).pose) << i;
}

TEST(BirdGuard, WhatMovedIsFrozenAtOnce) {
  Watch watch;
  for (int i = 0; i < 50; ++i) watch.see(kHere + Vector3d(0, 4.0 * i, 0));  // 400 mm/s
  const Vector3d last = kHere + Vector3d(0, 4.0 * 50, 0);
  ASSERT_TRUE(watch.see(last, Matrix3d::Identity(), 0).pose);
  for (int i = 0; i < 80; ++i) EXPECT_EQ(watch.see(last, Matrix3d::Identity(), 0).kind, DoubtKind::frozen);
  watch.see(kHere);
  watch.see_often(5, kHere);  // of a bird that was frozen more is asked
  EXPECT_EQ(watch.see_often(10, kHere), 10);
}

/// Its noise did not show while it moved, but no record was one of those before.
TEST(BirdGuard, ARecordThatRepeatsConfirmsNothingWhereRecordsSeldomDo) {
  Watch watch;
  const auto at = [](int i) { return Vector3d(300, 80 + i, -40); };
  for (int i = 0; i < 800; ++i) watch.see(at(i % 400), Matrix3d::Identity(), 0.05);
  for (int i = 0; i < 60; ++i) watch.see(Record{std::vector<std::int16_t>(12, 0), {}});  // saturated
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(watch.see(kHere, Matrix3d::Identity(), 0).pose) << i;
  watch.see_often(6, kHere);
  EXPECT_EQ(watch.see_often(10, kHere), 10);
}

TEST(BirdGuard, AFlipIsNamedAsLongAsItLastsWhileTheSensorMoves) {
  Watch watch;
  const auto at = [](int i) { return Vector3d(300 - 0.5 * i, 80 + i, -40); };
  for (int i = 0; i < 50; ++i) watch.see(at(i));
  for (int i = 50; i < 250; ++i) {
    const BirdReading reading = watch.see(-at(i));
    EXPECT_EQ(reading.kind, DoubtKind::hemisphere_flip) << i;
    EXPECT_THAT(reading.doubt, HasSubstr("hemisphere flip"));
  }
  for (int i = 250; i < 300; ++i) EXPECT_TRUE(watch.see(at(i)).pose) << i;
}

TEST(BirdGuard, ASensorThatCrossesTheBorderIsNotBelievedBeyondIt) {
  // The unit reports what lies in its half-space: +X. The sensor goes through the plane, and comes back.
  Watch watch;
  int near = 0, flipped = 0, good = 0;
  for (int i = 0; i < 400; ++i) {
    const double x = 200 - 2.0 * std::min(i, 400 - i);  // 200 down to -200 and back
    const Vector3d truth(x, 150, 60);
    const BirdReading reading = watch.see(x < 0 ? Vector3d(-truth) : truth);
    if (reading.pose) {
      ++good;
      EXPECT_LT((*reading.pose->position_mm - truth).norm(), 2) << i;
    }
    near += reading.kind == DoubtKind::hemisphere_border ? 1 : 0;
    flipped += reading.kind == DoubtKind::hemisphere_flip ? 1 : 0;
  }
  EXPECT_GT(good, 180);
  EXPECT_GT(near, 10);
  EXPECT_GT(flipped, 150);
}

TEST(BirdGuard, AFlipIsRememberedOverAShortGapAndNotForEver) {
  Watch watch;
  watch.see_often(20, kHere);
  watch.seconds += 1;
  for (int i = 0; i < 20; ++i) EXPECT_EQ(watch.see(-kHere).kind, DoubtKind::hemisphere_flip);
  // Whatever it was: after seconds of nothing, what the unit says is believed again.
  watch.seconds += 5;
  watch.see(kHere);
  EXPECT_EQ(watch.see_often(50, kHere), 50);
}

TEST(BirdGuard, OutsideTheHalfSpaceThatIsSetNothingIsBelieved) {
  Watch watch({}, Hemisphere::lower);  // +Z
  for (int i = 0; i < 100; ++i) EXPECT_EQ(watch.see({300, 0, -100}).kind, DoubtKind::outside_hemisphere);
  watch.seconds += 3;
  watch.see({300, 0, 100});
  EXPECT_EQ(watch.see_often(50, {300, 0, 100}), 50);
}

TEST(BirdGuard, NoStreamThatIsGoodIsDoubtedForEver) {
  // Whatever came before, soon after it is over the sensor's readings have poses.
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(-800, 800);
    Watch watch;
    for (int i = 0; i < 60; ++i) {
      const auto what = random() % 6;
      if (what == 0) watch.seconds += 0.3 * static_cast<double>(random() % 12);
      if (what == 1) watch.see(Vector3d(anywhere(random), anywhere(random), anywhere(random)));
      if (what == 2) watch.see(-kHere);
      if (what == 3) watch.see(kHere, Matrix3d::Zero());
      if (what == 4) watch.see_often(static_cast<int>(random() % 8), kHere);
      if (what == 5) watch.see_often(static_cast<int>(random() % 8), Vector3d(anywhere(random), 100, 0));
    }
    watch.see_often(40, kHere);
    EXPECT_EQ(watch.see_often(100, kHere), 100) << seed;
  }
}

TEST(BirdGuard, NoisePassesOnceItIsKnown) {
  // 1.8 mm RMS, the tracker's static accuracy, all of it as noise.
  Watch watch;
  for (int i = 0; i < 300; ++i) watch.see(kHere, Matrix3d::Identity(), 1.8);
  int poses = 0;
  for (int i = 0; i < 2000; ++i) poses += watch.see(kHere, Matrix3d::Identity(), 1.8).pose ? 1 : 0;
  EXPECT_GT(poses, 1960);
}

}  // namespace
}  // namespace birdseye::drivers::minibird
