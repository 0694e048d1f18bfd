#include "host/overlay/trust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calibration/points/point_error.hpp"

namespace birdseye::host {
namespace {

const std::vector<Eigen::Vector3d> kFiducials{{0, 0, 0}, {60, 5, 0}, {10, 70, 20}, {30, 20, 50}};

TargetView view() {
  TargetView out;
  out.camera = {768, 576, 500, 500, 384, 288};
  out.target_in_patient_mm = {0, 0, 100};
  out.position_sigma_mm = 0.2;
  return out;
}

TEST(TargetMark, AddsUpWhatIsKnownOfTheTarget) {
  const TrustFigures figures{{0.3, 2, 0.5}, 0.5, 1.5};
  const auto mark = target_mark(view(), figures);
  ASSERT_TRUE(mark.has_value());
  EXPECT_NEAR(mark->rms_mm, std::sqrt(1.5 * 1.5 + 1.5 * 0.25 + 3 * 0.04), 1e-12);
  EXPECT_NEAR(mark->radius_px, mark->radius_mm * 500 / 100, 1e-9);
  EXPECT_FALSE(mark->motion_counted);
  TargetView moved = view();
  moved.jitter_mm = 2;
  moved.motion_error = MotionError{0.7, 1.4};
  const auto more = target_mark(moved, figures);
  EXPECT_NEAR(more->rms_mm, std::sqrt(1.5 * 1.5 + 1.5 * 0.25 + 4 + 0.49), 1e-12);
  const double rigid_mm = std::sqrt(1.5 * 1.5 + 1.5 * 0.25 + 4);
  EXPECT_NEAR(more->radius_mm, std::hypot(rigid_mm * std::sqrt(5.99 / 3), 1.4), 1e-12);
  EXPECT_TRUE(more->motion_counted);
}

TEST(TargetMark, IsNotDrawnByWhatIsNotKnownNorOutOfView) {
  EXPECT_FALSE(target_mark(view(), {{0.3, 2, std::nullopt}, 0.5, 1.5}).has_value());
  EXPECT_FALSE(target_mark(view(), {{0.3, 2, 0.5}, 0.5, std::nullopt}).has_value());
  TargetView aside = view();
  aside.target_in_patient_mm = {100, 0, 100};
  EXPECT_FALSE(target_mark(aside, {{0.3, 2, 0.5}, 0.5, 1.5}).has_value());
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
