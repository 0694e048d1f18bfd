#include "calibration/latency/latency.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/support/data.hpp"
#include "tests/support/latency_streams.hpp"

namespace birdseye::calibration {
namespace {

using simulated::Hand;
using simulated::record;
using simulated::Rotations;
using simulated::StreamSettings;

const Eigen::Quaterniond kBody(rotation_exp({0.4, -1.9, 0.7})), kBase(rotation_exp({-1.1, 0.6, 2.0}));

/// The bird of a miniBIRD: 103 Hz, half a degree.
StreamSettings tracker_of(unsigned seed) {
  StreamSettings s;
  s.rate_hz = 103;
  s.noise_deg = 0.5;
  s.seed = seed;
  return s;
}
/// Poses of the camera from a board, whose stamps are late.
StreamSettings camera_of(unsigned seed, double rate_hz) {
  StreamSettings s;
  s.rate_hz = rate_hz;
  s.noise_deg = 0.1;
  s.stamp_jitter_ms = 1;
  s.offset_ms = 83;
  s.seed = seed + 1000;
  s.body = kBody;
  s.base = kBase;
  return s;
}

bool covers(const std::array<double, 2>& interval, double value) {
  return interval[0] <= value && value <= interval[1];
}

TEST(Latency, EightyThreeMillisecondsToWithinOneWithAnIntervalThatIsTrueNineteenTimesOfTwenty) {
  int covered = 0, trials = 0;
  double worst = 0;
  for (const double rate_hz : {25.0, 60.0}) {
    for (unsigned seed = 1; seed <= 50; ++seed, ++trials) {
      const Hand hand(seed);
      const auto found = find_latency(record(hand, tracker_of(seed)), record(hand, camera_of(seed, rate_hz)));
      ASSERT_TRUE(found) << found.error().what;
      ASSERT_TRUE(found->determined);
      worst = std::max(worst, std::abs(found->offset_ms - 83));
      covered += covers(found->offset_ci95_ms, 83);
    }
  }
  EXPECT_LT(worst, 1);
  EXPECT_GE(covered, 90);
  EXPECT_LE(covered, 99);
}

TEST(Latency, FromTheMotionOfPicturesAlone) {
  int covered = 0, trials = 0;
  double worst = 0;
  for (const double rate_hz : {25.0, 60.0}) {
    for (unsigned seed = 1; seed <= 50; ++seed, ++trials) {
      const Hand hand(seed);
      StreamSettings camera = camera_of(seed, rate_hz);
      camera.stamp_jitter_ms = 0.3;
      const auto found =
          find_latency(simulated::record_poses(hand, tracker_of(seed), 1.8), simulated::film(hand, camera, 0.2));
      ASSERT_TRUE(found) << found.error().what;
      ASSERT_TRUE(found->determined);
      worst = std::max(worst, std::abs(found->offset_ms - 83));
      covered += covers(found->offset_ci95_ms, 83);
    }
  }
  EXPECT_LT(worst, 1);
  EXPECT_GE(covered, 90);
  EXPECT_LE(covered, 99);
}

Rotations read_stream(const std::string& name) {
  Rotations rows;
  std::ifstream in(*testing::data_dir() / "handeye_pose_streams" / name);
  std::string line;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    double t, x, y, z, qx, qy, qz, qw;
    if (words >> t >> x >> y >> z >> qx >> qy >> qz >> qw) rows.push_back({t, Eigen::Quaterniond(qw, qx, qy, qz)});
  }
  return rows;
}

TEST(Latency, OfARealRobotAndCameraIsThePublishedOne) {
  if (!testing::data_dir()) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA";
  const Rotations hand = read_stream("robot_arm_complete_bag_color_and_ir_base_link_sr300_hinge.csv");
  const Rotations eye = read_stream("robot_arm_complete_bag_color_and_ir_target_ir.csv");
  const auto found = find_latency(hand, eye);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_NEAR(found->offset_ms, 15, 3);  // the eye is late: the published -0.015 s is what its times want added
}

TEST(Latency, DriftOfFiftyPpmIsRecoveredWithItsInterval) {
  int covered = 0;
  constexpr unsigned kTrials = 20;
  for (unsigned seed = 1; seed <= kTrials; ++seed) {
    const Hand hand(seed);
    StreamSettings tracker = tracker_of(seed), camera = camera_of(seed, 25);
    tracker.seconds = camera.seconds = 120;
    camera.drift_ppm = 50;
    camera.drift_from_s = 60;
    const auto found = find_latency(record(hand, tracker), record(hand, camera));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->drift_ppm, 50, 20);
    EXPECT_GT(found->drift_ci95_ppm[0], 0);
    EXPECT_NEAR(found->offset_ms, 83, 0.5);
    covered += covers(found->drift_ci95_ppm, 50);
  }
  EXPECT_GE(covered, 17);
}

TEST(Latency, ExchangedStreamsGiveTheOpposite) {
  const Hand hand(9);
  const Rotations a = record(hand, tracker_of(9)), b = record(hand, camera_of(9, 60));
  const auto there = find_latency(a, b), back = find_latency(b, a);
  ASSERT_TRUE(there && back);
  EXPECT_NEAR(there->offset_ms, -back->offset_ms, 0.3);
  EXPECT_LT(rotation_angle_between(there->b_from_a, back->b_from_a.transpose()), 0.3 * kRadPerDeg);
  EXPECT_LT(rotation_angle_between(there->b_from_a, kBody.toRotationMatrix().transpose()), 0.3 * kRadPerDeg);
}

std::string reasons_of(const Verdict& verdict) {
  std::string text;
  for (const std::string& reason : verdict.reasons) text += reason + "; ";
  for (const std::string& step : verdict.next_steps) text += step + "; ";
  return text;
}

/// Fails, and says so in these words.
void expect_fail(const Rotations& a, const Rotations& b, const std::vector<std::string>& words) {
  const auto found = find_latency(a, b);
  ASSERT_TRUE(found) << found.error().what;
  const Verdict verdict = latency_verdict(*found, "tracker", "video");
  EXPECT_EQ(verdict.grade, Grade::fail) << found->offset_ms;
  for (const std::string& word : words)
    EXPECT_NE(reasons_of(verdict).find(word), std::string::npos) << reasons_of(verdict);
}

TEST(Latency, WhatDeterminesNothingFailsWithTheReason) {
  const Hand hand(4), other(77), still(4, 0.2);
  expect_fail(record(still, tracker_of(4)), record(still, camera_of(4, 25)),
              {"the tracker hardly moves", "the video hardly moves", "of at least 5 deg/s", "to and fro"});
  // Two bodies that have nothing to do with each other.
  expect_fail(record(hand, tracker_of(4)), record(other, camera_of(4, 25)), {"correlation"});
  StreamSettings tracker = tracker_of(4), camera = camera_of(4, 25);
  tracker.seconds = camera.seconds = 5;
  expect_fail(record(hand, tracker), record(hand, camera), {"in common, of at least 8"});
  // Further away than is sought.
  camera = camera_of(4, 25);
  camera.offset_ms = 1500;
  expect_fail(record(hand, tracker_of(4)), record(hand, camera),
              {"a lag of 1500 ms (correlation ", "beyond the 1000 ms either way", "stamped by one clock"});
  const auto filmed =
      find_latency(simulated::record_poses(hand, tracker_of(4), 1.8), simulated::film(hand, camera, 0.2));
  ASSERT_TRUE(filmed) << filmed.error().what;
  const std::string why = reasons_of(latency_verdict(*filmed, "tracker", "video"));
  EXPECT_NE(why.find("a lag of 1500 ms (correlation "), std::string::npos) << why;
}

/// Nearly even: each axis has two paces that are alike, so that the motion resembles itself a swing later.
Eigen::Quaterniond nearly_even(unsigned seed, double t) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> hz(0.45, 0.6), phase(0, 2 * std::numbers::pi), size(0.05, 0.2);
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (int wave = 0; wave < 2; ++wave) {
    for (int axis = 0; axis < 3; ++axis)
      v[axis] += size(random) * std::sin(2 * std::numbers::pi * hz(random) * t + phase(random));
  }
  return Eigen::Quaterniond(rotation_exp(v));
}

TEST(Latency, WhereTheTrueLagIsBeyondWhatIsSoughtNoOtherIsTheAnswer) {
  int named = 0, answered = 0;
  constexpr unsigned kMotions = 12;
  for (unsigned seed = 1; seed <= kMotions; ++seed) {
    const auto motion = [seed](double t) { return nearly_even(seed, t); };
    StreamSettings tracker = tracker_of(seed), camera = camera_of(seed, 25);
    tracker.noise_deg = 0.1;
    camera.noise_deg = 0.05;
    for (const double lag_ms : {1700.0, -1300.0}) {
      camera.offset_ms = lag_ms;
      const auto found = find_latency(record(motion, tracker), record(motion, camera));
      ASSERT_TRUE(found) << found.error().what;
      const Verdict verdict = latency_verdict(*found, "tracker", "video");
      EXPECT_EQ(verdict.grade, Grade::fail) << "motion " << seed << ": " << found->offset_ms << " for " << lag_ms;
      if (std::abs(1e3 * found->far_lag_s - lag_ms) <= 10 &&
          reasons_of(verdict).find("beyond the 1000 ms either way") != std::string::npos)
        ++named;
    }
    camera.offset_ms = 83;
    const auto within = find_latency(record(motion, tracker), record(motion, camera));
    ASSERT_TRUE(within) << within.error().what;
    const Verdict verdict = latency_verdict(*within, "tracker", "video");
    if (verdict.grade == Grade::fail) continue;
    ++answered;
    EXPECT_NEAR(within->offset_ms, 83, 2) << seed;
  }
  EXPECT_EQ(named, 2 * static_cast<int>(kMotions));
  EXPECT_GE(answered, static_cast<int>(kMotions) - 2);
}

TEST(Latency, AFarLagThatCouldNotBeComparedIsNoTie) {
  Latency latency;
  latency.overlap_s = 20;
  latency.correlation = 0.97;
  latency.determined = true;
  latency.sought_s = 1;
  latency.offset_ci95_ms = {-1, 1};
  latency.a.turn_speed_deg_s = latency.b.turn_speed_deg_s = 20;
  ASSERT_EQ(latency_verdict(latency, "tracker", "video").grade, Grade::pass);
  latency.far_lag_s = 2.5;
  latency.far_correlation = 0.96;
  const Verdict open = latency_verdict(latency, "tracker", "video");
  EXPECT_EQ(open.grade, Grade::marginal) << reasons_of(open);
  EXPECT_NE(reasons_of(open).find("cannot be told"), std::string::npos) << reasons_of(open);
  latency.far_sigmas = 1;
  EXPECT_EQ(latency_verdict(latency, "tracker", "video").grade, Grade::fail) << "a tie";
  latency.far_sigmas = 6;
  EXPECT_EQ(latency_verdict(latency, "tracker", "video").grade, Grade::pass);
  // A correlation that is higher by 0.03 is no more than noise where the fits say otherwise.
  latency.far_correlation = 1;
  EXPECT_EQ(latency_verdict(latency, "tracker", "video").grade, Grade::pass);
  latency.far_sigmas = -5;
  EXPECT_NE(reasons_of(latency_verdict(latency, "tracker", "video")).find("agree best at a lag of 2500 ms"),
            std::string::npos);
}

TEST(Latency, AnEvenSwingIsAmbiguousAndSaidToBe) {
  for (const double hz : {0.9, 1.5}) {
    const auto swing = [hz](double t) {
      return Eigen::Quaterniond(
          Eigen::AngleAxisd(0.3 * std::sin(2 * std::numbers::pi * hz * t), Eigen::Vector3d::UnitX()));
    };
    expect_fail(record(swing, tracker_of(6)), record(swing, camera_of(6, 25)),
                {"the motion repeats itself", "change pace"});
  }
}

/// Moves from 45 to 75 s only.
Eigen::Quaterniond now_and_then(const Hand& hand, double t) {
  return hand.rotation(std::clamp(t, 45.0, 75.0));
}

TEST(Latency, OfStreamsThatLastUnlikeLongThePartThatBothHaveIsUsed) {
  const Hand hand(12);
  const auto expect_found = [](const Result<Latency>& found, const std::string& words) {
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_TRUE(found->determined);
    EXPECT_NEAR(found->offset_ms, 83, 1.5);
    const Verdict verdict = latency_verdict(*found, "tracker", "video");
    EXPECT_NE(verdict.grade, Grade::fail) << reasons_of(verdict);
    EXPECT_NE(reasons_of(verdict).find(words), std::string::npos) << reasons_of(verdict);
  };
  StreamSettings tracker = tracker_of(12), camera = camera_of(12, 25);
  tracker.begin_s = 50;
  camera.seconds = 120;
  const std::string words =
      "only the 20.0 s that both have were used, of 20.0 s of the tracker and 120.0 s of the video";
  expect_found(find_latency(record(hand, tracker), record(hand, camera)), words);
  expect_found(find_latency(simulated::record_poses(hand, tracker, 1.8), simulated::film(hand, camera, 0.2)), words);
  // The stillness of what is not used counts for nothing.
  const auto moves = [&hand](double t) { return now_and_then(hand, t); };
  std::swap(tracker.begin_s, camera.begin_s);
  std::swap(tracker.seconds, camera.seconds);
  expect_found(find_latency(record(moves, tracker), record(moves, camera)), "of 120.0 s of the tracker and 20.0 s");
  // A tracker that fell silent for most of the time.
  tracker = tracker_of(12);
  tracker.seconds = 6;
  Rotations a = record(hand, tracker);
  tracker.begin_s = 110;
  const Rotations later = record(hand, tracker);
  a.insert(a.end(), later.begin(), later.end());
  camera.begin_s = 0;
  camera.seconds = 120;
  expect_found(find_latency(a, record(hand, camera)), "the tracker has a hole of 104.0 s");
  const auto found = find_latency(a, record(hand, camera));
  ASSERT_TRUE(found);
  EXPECT_LT(found->b.longest_gap_s, 0.1);  // what of the video is left out is no hole of it
  expect_found(found, "only the 11.9 s that both have");
}

TEST(Latency, ACommonPartOfTooLittleFailsByWhatItLacks) {
  const Hand hand(12);
  StreamSettings tracker = tracker_of(12), camera = camera_of(12, 25);
  camera.seconds = 120;
  tracker.begin_s = 50;
  tracker.seconds = 6;
  expect_fail(record(hand, tracker), record(hand, camera), {"6.0 s in common, of at least 8"});
  // All of the motion is before the tracker was heard.
  const auto moves = [&hand](double t) { return now_and_then(hand, t); };
  tracker.begin_s = 90;
  tracker.seconds = 20;
  expect_fail(record(moves, tracker), record(moves, camera), {"the tracker hardly moves", "the video hardly moves"});
  tracker.begin_s = 119.4;
  const auto found = find_latency(record(hand, tracker), record(hand, camera));
  ASSERT_TRUE(found) << found.error().what;  // a second of each may belong together
  EXPECT_EQ(latency_verdict(*found, "tracker", "video").grade, Grade::fail);
  camera.rate_hz = 2;
  const auto few = find_latency(record(hand, tracker), record(hand, camera));
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().what.find("of at least 8"), std::string::npos) << few.error().what;
}

TEST(Latency, OddRowsAreToldAndDoNoHarm) {
  const Hand hand(8);
  Rotations a = record(hand, tracker_of(8)), b = record(hand, camera_of(8, 25));
  a[50].time_s = std::nan("");
  a[60].base_from_body.coeffs().setConstant(std::nan(""));
  a[70].base_from_body.coeffs().setZero();
  a[80].time_s = a[79].time_s;
  std::swap(a[90], a[91]);
  for (int k = 0; k < 40; ++k)
    a[static_cast<std::size_t>(100 + 45 * k)].base_from_body = Eigen::Quaterniond(0, 1, 0, 0);
  a.erase(a.begin() + 800, a.begin() + 880);
  const auto found = find_latency(a, b);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_NEAR(found->offset_ms, 83, 1.5);
  const std::string reasons = reasons_of(latency_verdict(*found, "tracker", "video"));
  for (const char* words : {"3 rows of a", "1 rows of a were out of order", "1 rows of a bear the time of another",
                            "the tracker has a hole of 0.8 s"})
    EXPECT_NE(reasons.find(words), std::string::npos) << reasons;
}

TEST(Latency, StreamsThatCannotBeUsedAreRefused) {
  const Hand hand(8);
  const Rotations a = record(hand, tracker_of(8));
  const auto refused = [](const Rotations& p, const Rotations& q, const std::string& words) {
    const auto found = find_latency(p, q);
    ASSERT_FALSE(found);
    EXPECT_NE(found.error().what.find(words), std::string::npos) << found.error().what;
  };
  refused(a, {}, "stream b: 0 usable rows");
  StreamSettings later = camera_of(8, 25);
  later.begin_s = 60;
  refused(a, record(hand, later), "do not overlap");
  Rotations backwards = a;
  for (std::size_t i = 1000; i < backwards.size(); ++i) backwards[i].time_s -= 9;
  refused(backwards, a, "jumps back by");
  Rotations shuffled = a;
  for (std::size_t i = 0; i + 1 < shuffled.size(); i += 20) std::swap(shuffled[i], shuffled[i + 1]);
  refused(shuffled, a, "earlier than the row before");
}

}  // namespace
}  // namespace birdseye::calibration
