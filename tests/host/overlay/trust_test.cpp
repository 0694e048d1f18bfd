#include "host/overlay/trust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "calibration/points/point_error.hpp"

namespace birdseye::host {
namespace {

const std::vector<Eigen::Vector3d> kFiducials{{0, 0, 0}, {60, 5, 0}, {10, 70, 20}, {30, 20, 50}};

const CameraModel kCamera{768, 576, 500, 500, 384, 288};

/// Of a target straight ahead, as far away as the board was: 0.5 mm there are 2.5 px.
TrustFigures figures() {
  TrustFigures out{{0.3, 2.5, 0.5}, 0.5, 1.5};
  out.target_in_patient_mm = Eigen::Vector3d(0, 0, 100);
  return out;
}

FramePose pose() {
  FramePose out;
  out.position_sigma_mm = 0.2;
  return out;
}

TEST(TargetMark, AddsUpWhatIsKnownOfTheTarget) {
  const auto mark = target_mark(kCamera, pose(), figures());
  ASSERT_TRUE(mark.has_value());
  const double hand_eye_mm2 = 1.5 * 1.23 * 1.23 * 0.25;  // a bound, for it is estimated of twenty stations
  EXPECT_NEAR(mark->error.rms_mm(), std::sqrt(1.5 * 1.5 + hand_eye_mm2 + 3 * 0.04), 1e-12);
  EXPECT_NEAR(mark->radius_px, mark->error.radius95_mm() * 500 / 100, 1e-9);
  EXPECT_FALSE(mark->error.motion.has_value());
  FramePose shaken = pose();
  shaken.jitter_mm = 2;
  TrustFigures moved = figures();
  moved.motion_error = MotionError{0.7, 1.4};
  const auto more = target_mark(kCamera, shaken, moved);
  EXPECT_NEAR(more->error.rms_mm(), std::sqrt(1.5 * 1.5 + hand_eye_mm2 + 4 + 0.49), 1e-12);
  const double rigid_mm = std::sqrt(1.5 * 1.5 + hand_eye_mm2 + 4);
  EXPECT_NEAR(more->error.radius95_mm(), std::hypot(rigid_mm * std::sqrt(5.99 / 3), 1.4), 1e-12);
  EXPECT_TRUE(more->error.motion.has_value());
}

TEST(TargetMark, IsNotDrawnByWhatIsNotKnownNorOutOfView) {
  TrustFigures no_hand_eye = figures(), no_registration = figures(), no_target = figures(), aside = figures();
  no_hand_eye.scope.held_out_mm.reset();
  no_registration.target_mm.reset();
  no_target.target_in_patient_mm.reset();
  aside.target_in_patient_mm = Eigen::Vector3d(100, 0, 100);
  EXPECT_FALSE(target_mark(kCamera, pose(), no_hand_eye).has_value());
  EXPECT_FALSE(target_mark(kCamera, pose(), no_registration).has_value());
  EXPECT_FALSE(target_mark(kCamera, pose(), no_target).has_value());
  EXPECT_FALSE(target_mark(kCamera, pose(), aside).has_value());
}

TEST(ErrorBudget, HandEyeGrowsWithTheDistance) {
  const double at_board_mm = 1.23 * std::sqrt(1.5) * 0.5;  // a bound, for it is estimated of twenty stations
  TrustFigures far = figures(), near = figures();
  far.target_in_patient_mm = Eigen::Vector3d(0, 0, 200);
  near.target_in_patient_mm = Eigen::Vector3d(0, 0, 50);
  // Nothing says whether it is an angle or a length: the larger counts.
  EXPECT_NEAR(error_budget(kCamera, pose(), far)->hand_eye_mm, 2 * at_board_mm, 1e-12);
  EXPECT_NEAR(error_budget(kCamera, pose(), near)->hand_eye_mm, at_board_mm, 1e-12);
  // An angle alone, and a length alone.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.topLeftCorner<3, 3>().diagonal().setConstant(1e-6);
  far.scope.hand_eye_covariance = near.scope.hand_eye_covariance = covariance;
  EXPECT_NEAR(error_budget(kCamera, pose(), far)->hand_eye_mm, 2 * at_board_mm, 1e-12);
  EXPECT_NEAR(error_budget(kCamera, pose(), near)->hand_eye_mm, 0.5 * at_board_mm, 1e-12);
  covariance.setZero();
  covariance.bottomRightCorner<3, 3>().diagonal().setConstant(0.01);
  far.scope.hand_eye_covariance = covariance;
  EXPECT_NEAR(error_budget(kCamera, pose(), far)->hand_eye_mm, at_board_mm, 1e-12);
}

/// The 5 % quantiles of chi-square with two degrees of freedom a station, of printed tables.
TEST(ErrorBudget, HandEyeOfFewStationsCountsForMore) {
  const double estimate_mm = std::sqrt(1.5) * 0.5;
  for (const auto& [stations, quantile] :
       {std::pair{3, 1.635}, {6, 5.226}, {20, 26.509}, {50, 77.929}, {100, 168.279}}) {
    TrustFigures known = figures();
    known.scope.hand_eye_stations = stations;
    EXPECT_NEAR(error_budget(kCamera, pose(), known)->hand_eye_mm, estimate_mm * std::sqrt(2 * stations / quantile),
                3e-4)
        << stations;
  }
}

/// Held out at the board, a station's own pose is part of the error.
TEST(ErrorBudget, CountsThePosesScatterOnce) {
  TrustFigures known = figures();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.bottomRightCorner<3, 3>().diagonal().setConstant(0.01);
  known.scope.hand_eye_covariance = covariance;
  FramePose scattering = pose();
  scattering.jitter_mm = 0.5;  // of 1.5 x 0.25 - 3 x 0.01 mm2 that are counted
  EXPECT_NEAR(error_budget(kCamera, scattering, known)->pose_mm, 0, 1e-12);
  scattering.jitter_mm = 2;
  EXPECT_NEAR(error_budget(kCamera, scattering, known)->pose_mm, std::sqrt(4 - (1.5 * 0.25 - 3 * 0.01)), 1e-12);
}

TEST(ErrorBudget, CountsTheTimesOfFrameAndPoseByTheTargetsSpeed) {
  FramePose fast = pose();
  fast.target_speed_mm_s = 100;
  // Nobody has measured how late the camera is.
  EXPECT_NEAR(error_budget(kCamera, fast, figures())->time_mm, 100 * 0.020, 1e-9);
  fast.latency_known = true;
  EXPECT_EQ(error_budget(kCamera, fast, figures())->time_mm, 0);
  fast.time_sigma = Duration::from_ms(5);
  EXPECT_NEAR(error_budget(kCamera, fast, figures())->time_mm, 0.5, 1e-9);
}

TEST(ErrorBudget, CountsTheLensWhereTheTargetIsSeen) {
  TrustFigures known = figures();
  known.scope.camera_covariance = CameraMatrix::Zero();
  known.scope.camera_covariance->diagonal()(0) = known.scope.camera_covariance->diagonal()(1) = 25;  // fx, fy: 5 px
  EXPECT_NEAR(error_budget(kCamera, pose(), known)->lens_mm, 0, 1e-9) << "on the axis";
  known.target_in_patient_mm = Eigen::Vector3d(50, 0, 100);
  // 5 px of 500 px at a slope of a half are 2.5 px across, along one axis, of 0.2 mm each.
  EXPECT_NEAR(error_budget(kCamera, pose(), known)->lens_mm, std::sqrt(3.0 / 2) * 0.5, 1e-6);
}

/// By the bound under which the localisation error lies: four points leave it wide.
TEST(RegistrationError, CountsTheBoundOfTheLocalisationError) {
  const auto localisation = calibration::localisation_error_of(0.3, 4);
  const double expected_mm = calibration::TargetError(kFiducials, localisation.upper95_mm).rms_mm({30, 30, 20});
  EXPECT_EQ(registration_error_mm(0.3, kFiducials, {30, 30, 20}), expected_mm);
  EXPECT_GT(expected_mm, calibration::TargetError(kFiducials, localisation.rms_mm).rms_mm({30, 30, 20}));
}

}  // namespace
}  // namespace birdseye::host
