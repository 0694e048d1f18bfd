#include "calibration/hand_eye/pose_streams.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <span>
#include <sstream>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"
#include "tests/support/data.hpp"
#include "tests/support/hand_eye_stream.hpp"

namespace birdseye::calibration {
namespace {

struct Row {
  double time_s;
  Eigen::Vector3d position_mm;
  Eigen::Quaterniond rotation;
};

std::vector<Row> read_rows(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<Row> out;
  std::string line;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    double t = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
    if (words >> t >> x >> y >> z >> qx >> qy >> qz >> qw)
      out.push_back({t, 1000 * Eigen::Vector3d(x, y, z), Eigen::Quaterniond(qw, qx, qy, qz)});
  }
  return out;
}

struct RobotArm {
  std::vector<StampedSensor> sensor;
  std::vector<StampedView> views;
};
RobotArm read_robot_arm(const std::filesystem::path& data) {
  const std::string stem = "robot_arm_complete_bag_color_and_ir_";
  const auto folder = data / "handeye_pose_streams";
  RobotArm out;
  for (const Row& r : read_rows(folder / (stem + "base_link_sr300_hinge.csv")))
    out.sensor.push_back({r.time_s, {r.rotation, r.position_mm}});
  for (const Row& r : read_rows(folder / (stem + "target_ir.csv")))
    out.views.push_back({r.time_s, Transform<Marker, Camera>(r.rotation, r.position_mm).inverse()});
  return out;
}

struct SolvedStreams {
  HandEyeResult hand_eye;
  double offset_s = 0;  ///< a picture of time t shows the tracker's pose at t + offset_s
};
std::optional<SolvedStreams> solved(std::span<const StampedSensor> sensor, std::span<const StampedView> views) {
  const auto paired = pair_pose_streams(sensor, views);
  if (!paired) return std::nullopt;
  HandEyeInput input;
  input.stations = paired->stations;
  input.estimate_time_offset = true;
  const auto result = calibrate_hand_eye(input);
  if (!result || !result->solved) return std::nullopt;
  return SolvedStreams{*result, paired->offset_s + result->time_offset_s.value_or(0)};
}

TEST(PoseStreams, RobotArmAsPublished) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const RobotArm arm = read_robot_arm(*data);
  const auto result = solved(arm.sensor, arm.views);
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->offset_s, -0.015, 0.003);
  const auto sensor_from_camera = result->hand_eye.camera_from_sensor.inverse();
  EXPECT_LT((sensor_from_camera.translation() - Eigen::Vector3d(-1.4, -17.4, 3.8)).norm(), 3);
  const Eigen::Quaterniond published(-0.5993, 0.6064, -0.3721, 0.3671);
  EXPECT_LT(
      rotation_angle_between(sensor_from_camera.rotation(), published.normalized().toRotationMatrix()) * kDegPerRad, 1);
  EXPECT_LE(result->hand_eye.held_out_mm, 5);
  EXPECT_NEAR(result->hand_eye.observability.board_scale, 1, 0.01);
  EXPECT_NE(judge(result->hand_eye).grade, Grade::fail);
  RecordProperty("offset_ms", std::to_string(1000 * result->offset_s));
  RecordProperty("held_out_mm", std::to_string(result->hand_eye.held_out_mm));
}

/// Of two calibrations of one scope: their distance against what both state, squared.
double apart(const HandEyeResult& a, const HandEyeResult& b) {
  Vector6d error;
  error << rotation_log(Eigen::Matrix3d(a.camera_from_sensor.rotation() * b.camera_from_sensor.rotation().transpose())),
      a.camera_from_sensor.translation() - b.camera_from_sensor.translation();
  return error.dot((a.covariance + b.covariance).ldlt().solve(error));
}

TEST(PoseStreams, PartsOfTheRobotArmsRecordingLieWithinWhatTheyState) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const RobotArm arm = read_robot_arm(*data);
  const double limit99 = distance_limit(0.01, 14);
  for (const std::size_t parts : {2U, 3U}) {
    std::vector<HandEyeResult> found;
    for (std::size_t k = 0; k < parts; ++k) {
      const std::size_t from = k * arm.views.size() / parts, to = (k + 1) * arm.views.size() / parts;
      const auto result = solved(arm.sensor, std::span(arm.views).subspan(from, to - from));
      ASSERT_TRUE(result);
      found.push_back(result->hand_eye);
    }
    for (std::size_t a = 0; a < parts; ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const Eigen::Vector3d off_mm =
            found[a].camera_from_sensor.translation() - found[b].camera_from_sensor.translation();
        EXPECT_LT(apart(found[a], found[b]), limit99) << parts << " parts, " << a << " and " << b;
        RecordProperty(fmt::format("of_{}_{}_and_{}", parts, a, b),
                       fmt::format("{:.2f} mm apart, distance {:.2f} of {:.2f}; at the board {:.2f} and {:.2f} mm",
                                   off_mm.norm(), std::sqrt(apart(found[a], found[b])), std::sqrt(limit99),
                                   found[a].sigma_at_board_mm(), found[b].sigma_at_board_mm()));
      }
    }
  }
}

/// A hand that turns this way and that, sampled by two clocks.
struct Recording {
  std::vector<StampedSensor> sensor;
  std::vector<StampedView> views;
};
Recording record(double offset_s, double speed) {
  const Transform<Camera, Sensor> camera_from_sensor(rotation_exp(Eigen::Vector3d(1, -0.4, 0.3)),
                                                     Eigen::Vector3d(10, 20, -150));
  const Transform<Tracker, Marker> tracker_from_marker(rotation_exp(Eigen::Vector3d(0, 2, 0.3)),
                                                       Eigen::Vector3d(200, 20, 300));
  const auto hand = [speed](double t) {
    const double s = speed * t;
    return Transform<Tracker, Sensor>(
        rotation_exp(
            Eigen::Vector3d(0.5 * std::sin(s), 0.6 * std::sin(1.7 * s + 1), 0.4 * std::sin(0.6 * s * s / (1 + s)))),
        Eigen::Vector3d(50 * std::sin(1.1 * s), 40 * std::cos(0.7 * s), 300 + 30 * std::sin(1.9 * s)));
  };
  Recording out;
  for (int i = 0; i < 2000; ++i) out.sensor.push_back({0.01 * i, hand(0.01 * i)});
  for (int i = 10; i < 560; ++i) {
    const double t = i / 30.0 + 0.003;
    out.views.push_back({t, camera_from_sensor * hand(t + offset_s).inverse() * tracker_from_marker});
  }
  return out;
}

TEST(PoseStreams, FindsTheOffsetOfTheClocks) {
  for (const double offset_s : {0.0, 0.083, -0.4, 1.25}) {
    const Recording r = record(offset_s, 1.5);
    const auto paired = pair_pose_streams(r.sensor, r.views);
    ASSERT_TRUE(paired) << paired.error().what;
    EXPECT_NEAR(paired->offset_s, offset_s, 0.002);
    HandEyeInput input;
    input.stations = paired->stations;
    input.estimate_time_offset = true;
    const auto result = calibrate_hand_eye(input);
    ASSERT_TRUE(result && result->solved);
    EXPECT_NEAR(paired->offset_s + *result->time_offset_s, offset_s, 1e-4);
    EXPECT_LT((result->camera_from_sensor.translation() - Eigen::Vector3d(10, 20, -150)).norm(), 0.05);
  }
}

/// Errors that last for a second and more: taken one by one, the residuals promise far too much.
TEST(PoseStreams, WhatErrsTogetherIsNotCountedAsManyMeasurements) {
  int within = 0;
  constexpr int kSeeds = 3;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const testing::HandEyeStream stream(
        {.seconds = 30, .sensor_hz = 25, .camera_hz = 10, .lasting_s = 3, .seed = seed});
    const auto paired = pair_pose_streams(stream.sensor, stream.views);
    ASSERT_TRUE(paired) << paired.error().what;
    HandEyeInput input;
    input.stations = paired->stations;
    input.estimate_time_offset = true;
    const auto found = calibrate_hand_eye(input);
    for (HandEyeStation& s : input.stations) s.time_s.reset();
    const auto one_by_one = calibrate_hand_eye(input);
    ASSERT_TRUE(found && found->solved && one_by_one && one_by_one->solved);
    EXPECT_LT((found->camera_from_sensor.translation() - one_by_one->camera_from_sensor.translation()).norm(), 1e-9);
    EXPECT_GT(found->sigma_at_board_mm(), 1.5 * one_by_one->sigma_at_board_mm()) << seed;
    EXPECT_GT(found->held_out_mm, one_by_one->held_out_mm) << seed;
    EXPECT_EQ(found->independent_stations, 12) << "blocks of neighbours";
    EXPECT_GT(one_by_one->independent_stations, 12);
    Vector6d error;
    error << rotation_log(
        Eigen::Matrix3d(stream.camera_from_sensor.rotation() * found->camera_from_sensor.rotation().transpose())),
        stream.camera_from_sensor.translation() - found->camera_from_sensor.translation();
    within += error.dot(found->covariance.ldlt().solve(error)) < found->region_limit ? 1 : 0;
  }
  EXPECT_GE(within, kSeeds - 1);
}

TEST(PoseStreams, RefusesWhatDoesNotCorrelate) {
  const Recording still = record(0, 0);
  EXPECT_FALSE(pair_pose_streams(still.sensor, still.views));
  Recording other = record(0, 1.5);
  other.sensor = record(0, 2.3).sensor;
  const auto refused = pair_pose_streams(other.sensor, other.views);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, ::testing::HasSubstr("do not correlate"));
  Recording apart = record(0, 1.5);
  for (StampedView& v : apart.views) v.time_s += 1e6;
  EXPECT_FALSE(pair_pose_streams(apart.sensor, apart.views));
  EXPECT_FALSE(pair_pose_streams(apart.sensor, std::span(apart.views).first(20)));
}

}  // namespace
}  // namespace birdseye::calibration
