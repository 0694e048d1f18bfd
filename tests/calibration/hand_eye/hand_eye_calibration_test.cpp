#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/hand_eye_bench.hpp"

namespace birdseye::calibration {
namespace {

using testing::HandEyeBench;
using testing::HandEyeScene;

double difference(const Transform<Camera, Sensor>& a, const Transform<Camera, Sensor>& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

Vector6d error_of(const HandEyeResult& result, const Transform<Camera, Sensor>& truth) {
  Vector6d out;
  out << rotation_log(truth.rotation() * result.camera_from_sensor.rotation().transpose()),
      truth.translation() - result.camera_from_sensor.translation();
  return out;
}

/// Each way of measuring, without noise.
struct Mode {
  const char* name;
  HandEyeScene scene;
};
class HandEyeModes : public ::testing::TestWithParam<Mode> {};

TEST_P(HandEyeModes, ExactDataGiveTheExactAnswer) {
  const HandEyeBench bench(GetParam().scene);
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result) << result.error().what;
  ASSERT_TRUE(result->solved);
  EXPECT_LT(difference(result->camera_from_sensor, bench.camera_from_sensor), 1e-9);
  EXPECT_TRUE(result->outliers.empty());
  EXPECT_NEAR(result->observability.board_scale, 1, 1e-9);
  if (GetParam().scene.time_offset_s != 0) {
    ASSERT_TRUE(result->time_offset_s);
    EXPECT_NEAR(*result->time_offset_s, GetParam().scene.time_offset_s, 1e-11);
  }
  for (const HandEyeStart& start : result->starts) {
    EXPECT_EQ(start.failed, "") << start.method;
    if (GetParam().scene.time_offset_s == 0) {
      EXPECT_LT(difference(start.camera_from_sensor, bench.camera_from_sensor), 1e-5) << start.method;
    }
  }
  EXPECT_EQ(judge(*result).grade, Grade::pass);
}

INSTANTIATE_TEST_SUITE_P(
    All, HandEyeModes,
    ::testing::Values(Mode{"board_at_rest", {.stations = 12}},
                      Mode{"moving_board", {.stations = 12, .moving_board = true}},
                      Mode{"stereo", {.stations = 12, .stereo = true}},
                      Mode{"time_offset", {.stations = 16, .time_offset_s = 0.02}},
                      Mode{"moving_board_time_offset", {.stations = 16, .moving_board = true, .time_offset_s = -0.015}},
                      Mode{"poses_only", {.stations = 12, .poses_only = true}},
                      Mode{"poses_only_time_offset", {.stations = 16, .poses_only = true, .time_offset_s = 0.01}}),
    [](const auto& tested) { return tested.param.name; });

HandEyeScene mini_bird(unsigned seed) {
  return {.corner_px = 0.3, .position_mm = 1.8, .angle_deg = 0.5, .seed = seed};
}

/// 1.8 mm and 0.5 degrees along each axis, which is harder than as root mean square of the three together.
TEST(HandEyeCalibration, HoldsWhatItStatesWithTheMiniBirdsNoise) {
  constexpr int kTrials = 100;
  int inside = 0, passed_over = 0;
  double angle = 0, shift = 0, stated_angle = 0, stated_shift = 0, size_squared_sigmas = 0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const HandEyeBench bench(mini_bird(seed));
    const auto result = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(result && result->solved) << seed;
    const Vector6d error = error_of(*result, bench.camera_from_sensor);
    inside += error.dot(result->covariance.ldlt().solve(error)) <= result->region_limit;
    passed_over += static_cast<int>(result->outliers.size());
    angle += error.head<3>().squaredNorm() / kTrials;
    shift += error.tail<3>().squaredNorm() / kTrials;
    stated_angle += result->covariance.topLeftCorner<3, 3>().trace() / kTrials;
    stated_shift += result->covariance.bottomRightCorner<3, 3>().trace() / kTrials;
    const auto& board = result->observability;
    size_squared_sigmas += std::pow((board.board_scale - 1) / board.board_scale_sigma, 2) / kTrials;
    EXPECT_NE(judge(*result).grade, Grade::fail);
  }
  EXPECT_LT(std::sqrt(angle) * kDegPerRad, 0.25);
  EXPECT_LT(std::sqrt(shift), 1.5);
  EXPECT_NEAR(std::sqrt(stated_angle / angle), 1, 0.15);
  EXPECT_NEAR(std::sqrt(stated_shift / shift), 1, 0.15);
  EXPECT_NEAR(std::sqrt(size_squared_sigmas), 1, 0.1) << "of the board's size";
  EXPECT_GE(inside, 90);
  EXPECT_LE(inside, 99);
  EXPECT_LE(passed_over, 2);  // of 3000
  RecordProperty("inside_95", inside);
  RecordProperty("size_sigmas", std::to_string(std::sqrt(size_squared_sigmas)));
  RecordProperty("rms_mm", std::to_string(std::sqrt(shift)));
  RecordProperty("rms_deg", std::to_string(std::sqrt(angle) * kDegPerRad));
}

TEST(HandEyeCalibration, FewCalibrationsLoseAGoodStation) {
  constexpr int kTrials = 100;
  int lost = 0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const HandEyeBench bench({.stations = 6, .corner_px = 0.1, .position_mm = 0.3, .angle_deg = 0.1, .seed = seed});
    const auto result = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(result && result->solved) << seed;
    lost += result->outliers.empty() ? 0 : 1;
    for (const auto& station : result->stations)
      EXPECT_TRUE(station.used || station.why_not.find("where chance allows") != std::string::npos) << station.why_not;
  }
  EXPECT_LE(lost, 3);  // of which one is to be expected
}

TEST(HandEyeCalibration, EstimatesTheNoiseOfTheTracker) {
  double position = 0, angle = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    auto scene = mini_bird(seed);
    scene.moving_board = seed % 2 == 0;
    const auto result = calibrate_hand_eye(HandEyeBench(scene).input);
    ASSERT_TRUE(result && result->solved);
    EXPECT_NEAR(result->corner_sigma_px, 0.3, 0.02);
    position += result->tracker_noise.position_sigma_mm / 8;
    angle += result->tracker_noise.angle_sigma_rad * kDegPerRad / 8;
  }
  EXPECT_NEAR(position, 1.8, 0.2);
  EXPECT_NEAR(angle, 0.5, 0.05);
}

TEST(HandEyeCalibration, StatedNoiseThatIsTooSmallIsNotBelieved) {
  HandEyeBench bench(mini_bird(3));
  const auto estimated = calibrate_hand_eye(bench.input);
  bench.input.tracker_noise = TrackerNoise{0.6, 0.5 / 3 * kRadPerDeg};
  const auto stated = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(estimated && estimated->solved && stated && stated->solved);
  EXPECT_NEAR(std::sqrt(stated->variance_factor), 3, 0.6);
  EXPECT_NEAR(stated->translation_sigma_mm().norm() / estimated->translation_sigma_mm().norm(), 1, 0.25);
  EXPECT_THAT(judge(*stated).reasons, ::testing::Contains(::testing::HasSubstr("stated noise")));
}

TEST(HandEyeCalibration, DoesNotDependOnTheOrder) {
  HandEyeBench bench(mini_bird(11));
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  std::mt19937 rng(4);
  for (int trial = 0; trial < 3; ++trial) {
    std::shuffle(bench.input.stations.begin(), bench.input.stations.end(), rng);
    for (HandEyeStation& s : bench.input.stations) {
      std::reverse(s.view.points_px.begin(), s.view.points_px.end());
      std::reverse(s.view.points_in_marker_mm.begin(), s.view.points_in_marker_mm.end());
    }
    const auto shuffled = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(shuffled && shuffled->solved);
    EXPECT_LT(difference(result->camera_from_sensor, shuffled->camera_from_sensor), 1e-9);
    EXPECT_LT((result->covariance - shuffled->covariance).norm(), 1e-9);
    EXPECT_NEAR(result->held_out_mm, shuffled->held_out_mm, 1e-9);
    EXPECT_EQ(judge(*result).reasons, judge(*shuffled).reasons);
  }
}

TEST(HandEyeCalibration, DoesNotDependOnTheScale) {
  for (const double length : {0.039370078740157, 7.3}) {
    auto scene = mini_bird(12);
    const auto result = calibrate_hand_eye(HandEyeBench(scene).input);
    scene.length = length;
    const auto scaled = calibrate_hand_eye(HandEyeBench(scene).input);
    ASSERT_TRUE(result && result->solved && scaled && scaled->solved);
    EXPECT_LT((scaled->camera_from_sensor.translation() / length - result->camera_from_sensor.translation()).norm(),
              5e-9);
    EXPECT_LT(rotation_angle_between(scaled->camera_from_sensor.rotation(), result->camera_from_sensor.rotation()),
              1e-11);
    EXPECT_NEAR(scaled->held_out_px, result->held_out_px, 1e-7);
  }
}

TEST(HandEyeCalibration, NamesTheStationsThatDoNotFit) {
  HandEyeBench bench(mini_bird(5));
  auto& stations = bench.input.stations;
  Vector6d shift, turn;
  shift << 0, 0, 0, 30, 0, -10;
  turn << 0, 8 * kRadPerDeg, 0, 0, 0, 0;
  stations[4].tracker_from_sensor = moved(stations[4].tracker_from_sensor, shift);
  stations[17].tracker_from_sensor = moved(stations[17].tracker_from_sensor, turn);
  std::swap(stations[20].tracker_from_sensor, stations[21].tracker_from_sensor);
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  EXPECT_THAT(result->outliers, ::testing::ElementsAre("station 4", "station 17", "station 20", "station 21"));
  EXPECT_LT(error_of(*result, bench.camera_from_sensor).tail<3>().norm(), 4);
  EXPECT_THAT(result->stations[17].why_not, ::testing::StartsWith("outlier: "));
  EXPECT_THAT(judge(*result).reasons, ::testing::Contains(::testing::HasSubstr("station 17")));
}

TEST(HandEyeCalibration, OfFewStationsTheOddOneIsNamed) {
  HandEyeScene scene = mini_bird(8);
  scene.stations = 7;
  scene.position_mm = 0.2;
  scene.angle_deg = 0.08;
  HandEyeBench bench(scene);
  auto& stations = bench.input.stations;
  Vector6d off;
  off << 0, 0.35 * kRadPerDeg, 0, 0.5, 0, 0.3;  // four times the noise
  stations[3].tracker_from_sensor = moved(stations[3].tracker_from_sensor, off);
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  EXPECT_THAT(result->outliers, ::testing::ElementsAre("station 3"));
  EXPECT_EQ(result->independent_stations, 6);
}

TEST(HandEyeCalibration, AStationThatStandsOutIsTold) {
  HandEyeBench bench(mini_bird(8));
  auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  EXPECT_THAT(judge(*result).reasons, ::testing::Not(::testing::Contains(::testing::HasSubstr("odd: "))));
  result->stations[6].held_out_px = 4 * result->held_out_median_px;
  const Verdict verdict = judge(*result);
  EXPECT_THAT(verdict.reasons,
              ::testing::Contains(::testing::AllOf(::testing::HasSubstr("odd: "), ::testing::HasSubstr("station 6"))));
}

TEST(HandEyeCalibration, BadCornersDoNotMoveIt) {
  HandEyeBench bench({.stations = 12, .corner_px = 0.2, .position_mm = 0.1, .angle_deg = 0.02, .seed = 8});
  const auto clean = calibrate_hand_eye(bench.input);
  for (HandEyeStation& s : bench.input.stations) {
    for (std::size_t i = 0; i < s.view.points_px.size(); i += 17) s.view.points_px[i] += Eigen::Vector2d(25, -13);
  }
  const auto spoiled = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(clean && clean->solved && spoiled && spoiled->solved);
  EXPECT_LT((clean->camera_from_sensor.translation() - spoiled->camera_from_sensor.translation()).norm(), 0.1);
  EXPECT_EQ(spoiled->stations[3].corners_left_out, 6U);
  EXPECT_EQ(clean->stations[3].corners_left_out, 0U);
}

/// What is left out is predicted no better by having been there.
TEST(HandEyeCalibration, HoldsOutForTrue) {
  const HandEyeBench bench({.stations = 9, .corner_px = 0.2, .position_mm = 0.5, .angle_deg = 0.1, .seed = 2});
  HandEyeInput all = bench.input;
  all.tracker_noise = TrackerNoise{0.5, 0.1 * kRadPerDeg};
  const auto result = calibrate_hand_eye(all);
  ASSERT_TRUE(result && result->solved && result->outliers.empty());
  EXPECT_GT(result->held_out_px, result->tracked_px);
  for (std::size_t i = 0; i < all.stations.size(); ++i) {
    HandEyeInput others = all;
    others.corner_sigma_px = result->corner_sigma_px;
    others.stations.erase(others.stations.begin() + static_cast<std::ptrdiff_t>(i));
    const auto without = calibrate_hand_eye(others);
    ASSERT_TRUE(without && without->solved);
    const auto board = without->camera_from_sensor * all.stations[i].tracker_from_sensor.inverse() *
                       Transform<Tracker, Marker>::from_matrix(without->body_from_marker.matrix());
    double squares = 0;
    const PatternView& view = all.stations[i].view;
    for (std::size_t k = 0; k < view.points_px.size(); ++k)
      squares += (*project(*all.camera, board * view.points_in_marker_mm[k]) - view.points_px[k]).squaredNorm();
    const double held_out_px = std::sqrt(squares / static_cast<double>(view.points_px.size()));
    EXPECT_NEAR(result->stations[i].held_out_px / held_out_px, 1, 0.01);
  }
}

TEST(HandEyeCalibration, ABoardWithoutAFirstEndIsNamedAlike) {
  for (const int fold : {2, 4}) {
    HandEyeBench bench({.corner_px = 0.1, .position_mm = 0.3, .angle_deg = 0.1, .roll_rad = 0.7, .seed = 6});
    const auto told = calibrate_hand_eye(bench.input);
    const BoardSymmetry symmetry{{30, 21}, fold};
    for (std::size_t i = 0; i < bench.input.stations.size(); ++i) {
      const auto guess = symmetry.turned(static_cast<int>(i * i) % fold);
      for (Eigen::Vector3d& p : bench.input.stations[i].view.points_in_marker_mm) p = guess * p;
    }
    const auto guessed = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(guessed);
    EXPECT_EQ(judge(*guessed).grade, Grade::fail);
    bench.input.symmetry = symmetry;
    const auto resolved = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(told && told->solved && resolved && resolved->solved);
    EXPECT_LT(difference(told->camera_from_sensor, resolved->camera_from_sensor), 1e-6);
    EXPECT_LT((told->covariance - resolved->covariance).norm(), 1e-6 * told->covariance.norm());
  }
}

}  // namespace
}  // namespace birdseye::calibration
