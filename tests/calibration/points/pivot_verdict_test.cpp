#include "calibration/points/pivot_verdict.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/simulated_pointer.hpp"

namespace birdseye::calibration {
namespace {

std::string text_of(const Verdict& verdict) {
  std::string out = name_of(verdict.grade);
  for (const std::string& reason : verdict.reasons) out += "\n" + reason;
  for (const std::string& step : verdict.next_steps) out += "\nnext: " + step;
  return out;
}

Verdict judged(const std::vector<PivotPose>& poses) {
  const auto solved = solve_pivot(poses);
  return solved ? judge_pivot(*solved) : Verdict{Grade::fail, {solved.error().what}, {}};
}

void expect_verdict(const std::vector<PivotPose>& poses, Grade grade, const std::string& words) {
  const Verdict verdict = judged(poses);
  EXPECT_EQ(verdict.grade, grade) << text_of(verdict);
  EXPECT_NE(text_of(verdict).find(words), std::string::npos) << words << "\n" << text_of(verdict);
}

void shift(PivotPose& pose, const Eigen::Vector3d& by_mm) {
  const auto was = pose.tracker_from_sensor;
  pose.tracker_from_sensor = {was.rotation(), Eigen::Vector3d(was.translation() + by_mm)};
}

void scale(std::vector<PivotPose>& poses, double by) {
  for (PivotPose& pose : poses)
    pose.tracker_from_sensor = {pose.tracker_from_sensor.rotation(),
                                Eigen::Vector3d(by * pose.tracker_from_sensor.translation())};
}

TEST(PivotVerdict, GoodPosesPass) {
  const Verdict verdict = judged(SimulatedPointer{.position_noise_mm = 0.3}.poses(60));
  EXPECT_EQ(verdict.grade, Grade::pass) << text_of(verdict);
  EXPECT_TRUE(verdict.next_steps.empty());
  EXPECT_GE(verdict.reasons.size(), 6U);
}

TEST(PivotVerdict, NoiseOfTheTrackerThatTheCartHasDoesNotFail) {
  // 1.8 mm and 0.5 degrees rms in all.
  const Verdict verdict =
      judged(SimulatedPointer{.position_noise_mm = 1.8 / 1.732, .angle_noise_deg = 0.5 / 1.732}.poses(120));
  EXPECT_NE(verdict.grade, Grade::fail) << text_of(verdict);
}

TEST(PivotVerdict, EachFaultHasItsWords) {
  expect_verdict(SimulatedPointer{.position_noise_mm = 0.2}.poses(3), Grade::fail, "3 poses: a pivot needs at least 4");
  expect_verdict(SimulatedPointer{.position_noise_mm = 0.2}.poses(6), Grade::fail, "poses that differ 6, less than 8");
  expect_verdict(SimulatedPointer{.position_noise_mm = 0.2}.poses(15), Grade::marginal,
                 "poses that differ 15, less than 20");
  expect_verdict(SimulatedPointer{.position_noise_mm = 0.2}.poses(4), Grade::fail, "no held-out error");
  auto twice = std::vector<PivotPose>(40, SimulatedPointer().poses(1)[0]);
  expect_verdict(twice, Grade::fail, "poses that differ 1, less than 8");
  expect_verdict(twice, Grade::fail, "tilted through 0 degrees");
  expect_verdict(SimulatedPointer{.tilt_deg = 5, .sideways_deg = 5, .position_noise_mm = 0.01}.poses(60), Grade::fail,
                 "degrees, less than 25");
  expect_verdict(SimulatedPointer{.tilt_deg = 14, .sideways_deg = 14, .position_noise_mm = 0.05}.poses(60),
                 Grade::marginal, "degrees, less than 40");
  expect_verdict(SimulatedPointer{.sideways_deg = 1, .position_noise_mm = 0.05}.poses(60), Grade::fail,
                 "turned about no more than one axis, (1.00, ");
  expect_verdict(SimulatedPointer{.sideways_deg = 0, .position_noise_mm = 0.05}.poses(60), Grade::fail,
                 "no standard error of the tip: along (1.00, ");
  expect_verdict(SimulatedPointer{.sideways_deg = 8, .position_noise_mm = 0.05}.poses(60), Grade::marginal,
                 "turned about little more than one axis");
  expect_verdict(SimulatedPointer{.position_noise_mm = 2}.poses(400), Grade::marginal,
                 "distance of the tip from its pivot");
  expect_verdict(SimulatedPointer{.position_noise_mm = 8}.poses(100), Grade::fail,
                 "distance of the tip from its pivot");
  expect_verdict(SimulatedPointer{.position_noise_mm = 2}.poses(40), Grade::marginal, "standard error of the tip");

  SimulatedPointer pointer{.position_noise_mm = 0.2};
  auto metres = pointer.poses(60);
  scale(metres, 1e-3);
  expect_verdict(metres, Grade::fail, "--unit m");
  auto millimetres = pointer.poses(60);
  scale(millimetres, 1e3);
  expect_verdict(millimetres, Grade::fail, "take --unit m away");

  auto slid = pointer.poses(60);
  for (std::size_t i = 0; i < slid.size(); ++i) shift(slid[i], Eigen::Vector3d(0, 3, 0) * static_cast<double>(i) / 59);
  expect_verdict(slid, Grade::marginal, "the tip slid by 2.");
  auto slid_far = pointer.poses(60);
  for (std::size_t i = 0; i < 60; ++i) shift(slid_far[i], Eigen::Vector3d(0, 6, 0) * static_cast<double>(i) / 59);
  expect_verdict(slid_far, Grade::fail, "the tip slid by ");

  auto lifted = pointer.poses(60);
  for (std::size_t i = 0; i < 12; ++i) shift(lifted[5 * i], pointer.noise(15));
  expect_verdict(lifted, Grade::marginal, "poses that do not agree with the others");
  auto two_divots = pointer.poses(30);
  pointer.pivot_mm += Eigen::Vector3d(30, 0, 0);
  for (const PivotPose& pose : pointer.poses(26)) two_divots.push_back(pose);
  expect_verdict(two_divots, Grade::fail, "--phases");
  // Poses that have nothing to do with each other.
  auto wild = pointer.poses(40);
  for (PivotPose& pose : wild) shift(pose, pointer.noise(200));
  expect_verdict(wild, Grade::fail, "distance of the tip from its pivot");
}

std::vector<Transform<Tracker, Sensor>> spun(double turn_deg, double wobble_deg, int count) {
  SimulatedPointer pointer;
  const Eigen::Vector3d axis = Eigen::Vector3d(0.1, -0.05, 1).normalized();
  std::vector<Transform<Tracker, Sensor>> poses;
  for (int i = 0; i < count; ++i) {
    const Eigen::Matrix3d rotation = rotation_exp(pointer.noise(wobble_deg * kRadPerDeg)) *
                                     Eigen::AngleAxisd(turn_deg * kRadPerDeg * i / count, axis).toRotationMatrix();
    poses.emplace_back(rotation, Eigen::Vector3d(pointer.pivot_mm - rotation * pointer.tip_mm));
  }
  return poses;
}

TEST(SpinAxis, IsTheDirectionThatStandsStill) {
  const Eigen::Vector3d truth = Eigen::Vector3d(0.1, -0.05, 1).normalized();
  const auto exact = solve_spin_axis(spun(300, 0, 30), {0, 0, 180});
  ASSERT_TRUE(exact) << exact.error().what;
  EXPECT_LT((exact->axis_in_sensor - truth).norm(), 1e-7);
  EXPECT_NEAR(exact->turned_deg, 290, 1e-6);
  EXPECT_LT((solve_spin_axis(spun(300, 0, 30), {0, 0, -1})->axis_in_sensor + truth).norm(), 1e-7);
  auto poses = spun(300, 0.5, 60);
  poses[7] = {Eigen::Matrix3d(rotation_exp({0.3, 0, 0}) * poses[7].rotation()), poses[7].translation()};
  const auto noisy = solve_spin_axis(poses, {0, 0, 180});
  ASSERT_TRUE(noisy);
  EXPECT_EQ(std::count(noisy->outliers.begin(), noisy->outliers.end(), 7U), 1);
  EXPECT_LT(std::acos(noisy->axis_in_sensor.dot(truth)) * kDegPerRad, 3 * noisy->sigma_deg);
  EXPECT_NEAR(noisy->wobble_deg, 0.5 * 1.414, 0.15);
}

TEST(SpinAxis, EachFaultHasItsWords) {
  const auto verdict = [](double turn_deg, double wobble_deg, int count) {
    return judge_spin_axis(*solve_spin_axis(spun(turn_deg, wobble_deg, count), {0, 0, 1}));
  };
  EXPECT_EQ(verdict(300, 0.5, 60).grade, Grade::pass) << text_of(verdict(300, 0.5, 60));
  EXPECT_NE(text_of(verdict(120, 0.5, 60)).find("marginal\nspun through"), std::string::npos);
  EXPECT_NE(text_of(verdict(60, 0.5, 60)).find("fail\nspun through"), std::string::npos);
  EXPECT_NE(text_of(verdict(300, 2, 200)).find("wobble of the spun shaft"), std::string::npos);
  EXPECT_EQ(verdict(300, 5, 200).grade, Grade::fail);
  EXPECT_NE(text_of(verdict(300, 1.3, 10)).find("standard error of the axis"), std::string::npos);
  EXPECT_EQ(solve_spin_axis(spun(300, 0, 3), {0, 0, 1}).error().code, Errc::degenerate);
}

}  // namespace
}  // namespace birdseye::calibration
