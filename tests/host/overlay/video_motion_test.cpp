#include "host/overlay/video_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "tests/support/textured_scene.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;

const CameraModel kScope{192, 144, 150, 150, 95.5, 71.5};

ScopeSetup scope_with(const Transform<Camera, Sensor>& camera_from_sensor) {
  ScopeFigures figures;
  figures.camera_rms_px = 0.2;
  figures.held_out_px = 1;
  figures.held_out_mm = 0.7;
  return *ScopeSetup::of_values(kScope, std::nullopt, camera_from_sensor, figures);
}

/// A scope that looks about over a scene for ten seconds. told: its hand-eye, as the window has it.
struct LookingAbout {
  Transform<Camera, Sensor> camera_from_sensor{rotation_exp(Vector(0.2, -0.1, 0.4)), Vector(5, -3, -300)};
  Transform<Camera, Sensor> told = camera_from_sensor;
  double haste = 1;   ///< 0: it rests
  double late_s = 0;  ///< of the pictures' stamps
  bool latency_measured = true;
  std::function<Vector(double t_s)> scene_moves{};  ///< against the tracker
  bool pattern = true;
  VideoMotion motion;

  void look(double from_s, double seconds) {
    testing::TexturedScene scene(Vector(0, 0, 0));
    std::mt19937 random(3);
    std::normal_distribution<double> position_mm(0, 0.3), angle_rad(0, 0.1 * kRadPerDeg);
    const auto normal3 = [&](auto& of) { return Vector(of(random), of(random), of(random)); };
    const ScopeSetup scope = scope_with(told);
    for (int i = 0; i < static_cast<int>(seconds * 100); ++i) {
      const double t_s = from_s + i * 0.01, s = haste * t_s;
      const Eigen::Matrix3d turn =
          rotation_exp(Vector(0.3 * std::sin(1.4 * s), 0.35 * std::sin(1.1 * s + 1), 0.4 * std::sin(0.8 * s)));
      const Transform<Camera, Patient> view(
          turn, Vector(8 * std::sin(s), 9 * std::cos(1.3 * s), 100 + 15 * std::sin(0.9 * s)));
      const auto sensor = view.inverse() * camera_from_sensor;
      motion.take({std::llround(t_s * 1e9)},
                  Transform<Tracker, Sensor>(rotation_exp(normal3(angle_rad)) * sensor.rotation(),
                                             Vector(sensor.translation() + normal3(position_mm))));
      if (i % 4 != 0) continue;
      wire::VideoFrame frame;
      frame.info.acquired = {std::llround((t_s + late_s) * 1e9)};
      if (latency_measured) frame.info.latency = Duration{0};
      frame.width_px = kScope.width_px;
      frame.height_px = kScope.height_px;
      const Vector moved = scene_moves ? scene_moves(t_s) : Vector::Zero().eval();
      auto rgb = scene.picture(kScope, view * Transform<Patient, Patient>(Eigen::Matrix3d::Identity(), moved));
      if (!pattern) std::fill(rgb.begin(), rgb.end(), std::uint8_t{90});
      frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::move(rgb));
      motion.take(frame, scope);
    }
  }
};

Transform<Camera, Camera> turned_by(double degrees, const Vector& axis) {
  return {rotation_exp(Vector(degrees * kRadPerDeg * axis.normalized())), Vector::Zero()};
}

TEST(VideoMotion, AgreesWhereHandEyeIsRight) {
  LookingAbout about;
  about.look(0, 10);
  EXPECT_EQ(about.motion.state(), VideoAgreement::agrees);
  ASSERT_TRUE(about.motion.off_px());
  EXPECT_LT(*about.motion.off_px(), 3);
}

TEST(VideoMotion, TellsNothingOfAScopeThatRests) {
  LookingAbout about;
  about.haste = 0;
  about.look(0, 10);
  EXPECT_EQ(about.motion.state(), VideoAgreement::untold);
}

TEST(VideoMotion, TellsNothingByAPictureWithoutAPattern) {
  LookingAbout about;
  about.pattern = false;
  about.look(0, 10);
  EXPECT_EQ(about.motion.state(), VideoAgreement::untold);
  EXPECT_FALSE(about.motion.off_px());
}

TEST(VideoMotion, AHandEyeTurnedAboutAnyAxisIsFoundOut) {
  for (const Vector& axis : {Vector(1, 0, 0), Vector(0, 1, 0), Vector(0, 0, 1), Vector(1, -1, 1)}) {
    for (const double degrees : {-30.0, 30.0}) {
      LookingAbout about;
      about.told = turned_by(degrees, axis) * about.camera_from_sensor;
      about.look(0, 10);
      EXPECT_EQ(about.motion.state(), VideoAgreement::differs) << axis.transpose() << ", " << degrees;
    }
  }
}

TEST(VideoMotion, WhatMovesIsSeenAndHasToAgreeTwiceAsOftenAfter) {
  LookingAbout about;
  about.look(0, 10);
  ASSERT_EQ(about.motion.state(), VideoAgreement::agrees);
  about.scene_moves = [](double t_s) { return Vector(Vector(9, 9, 0) * std::min(1.0, 3 * (t_s - 10))); };
  about.look(10, 1);
  EXPECT_EQ(about.motion.state(), VideoAgreement::differs);
  about.scene_moves = [](double) { return Vector(9, 9, 0); };
  about.look(11, 0.5);
  EXPECT_EQ(about.motion.state(), VideoAgreement::differs) << "half a second is not enough to believe it again";
  about.look(11.5, 20);
  EXPECT_EQ(about.motion.state(), VideoAgreement::agrees);
}

TEST(VideoMotion, IsInDoubtFromTheFirstPictureThatDoesNotAgree) {
  LookingAbout about;
  about.look(0, 10);
  std::vector<VideoAgreement> states{about.motion.state()};
  about.scene_moves = [](double t_s) { return Vector(Vector(4, 4, 0) * std::min(1.0, 3 * (t_s - 10))); };
  for (int i = 0; i < 25; ++i) {
    about.look(10 + 0.04 * i, 0.04);
    if (about.motion.state() != states.back()) states.push_back(about.motion.state());
  }
  EXPECT_EQ(states, (std::vector{VideoAgreement::agrees, VideoAgreement::in_doubt, VideoAgreement::differs}));
}

TEST(VideoMotion, WhatWasInDoubtAsThePictureChangedHasToAgreeAnew) {
  LookingAbout about;
  about.look(0, 10);
  about.scene_moves = [](double t_s) { return Vector(Vector(4, 4, 0) * std::min(1.0, 3 * (t_s - 10))); };
  double t_s = 10;
  for (; about.motion.state() == VideoAgreement::agrees && t_s < 11; t_s += 0.04) about.look(t_s, 0.04);
  ASSERT_EQ(about.motion.state(), VideoAgreement::in_doubt);
  about.scene_moves = [](double) { return Vector(300, 0, 0); };  // another picture: nothing is followed on
  about.look(t_s, 0.3);
  EXPECT_EQ(about.motion.state(), VideoAgreement::untold);
}

/// A grabber hands its pictures on 20 ms late, and a scope moves fast.
TEST(VideoMotion, ALatencyThatNobodyMeasuredIsNoHandEyeThatIsOff) {
  for (const bool measured : {false, true}) {
    LookingAbout about;
    about.haste = 3;
    about.late_s = 0.02;
    about.latency_measured = measured;
    int differs = 0;
    for (int i = 0; i < 80; ++i) {
      about.look(0.25 * i, 0.25);
      differs += about.motion.state() == VideoAgreement::differs ? 1 : 0;
    }
    // Where it is said to have been measured, the stamps are wrong.
    if (measured) {
      EXPECT_GT(differs, 40);
    } else {
      EXPECT_EQ(differs, 0);
    }
  }
}

TEST(VideoMotion, AnotherCalibrationBeginsAnew) {
  LookingAbout about;
  about.look(0, 10);
  ASSERT_EQ(about.motion.state(), VideoAgreement::agrees);
  about.told = turned_by(1, Vector(0, 0, 1)) * about.camera_from_sensor;
  about.look(10, 0.1);
  EXPECT_EQ(about.motion.state(), VideoAgreement::untold);
}

TEST(VideoMotion, AClockThatGoesBackBeginsAnew) {
  LookingAbout about;
  about.look(100, 10);
  ASSERT_EQ(about.motion.state(), VideoAgreement::agrees);
  about.look(0, 0.1);
  EXPECT_EQ(about.motion.state(), VideoAgreement::untold);
}

}  // namespace
}  // namespace birdseye::host
