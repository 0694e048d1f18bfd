#include "host/overlay/video_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "tests/support/looking_about.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;

struct Watcher : VideoMotion {
  using VideoMotion::take;
  bool take(const wire::VideoFrame& frame, const ScopeSetup& scope) {
    const bool another = VideoMotion::take(frame, picture_to_follow(frame), scope, farthest_mm);
    contradictions += contradicted() ? 1 : 0;
    return another;
  }
  int contradictions = 0;
  double farthest_mm = kFarthestSeen_mm;
};
using LookingAbout = testing::LookingAbout<Watcher>;

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

/// Also where no edge of the round field tells of it. It may agree for a moment: a longer lens looks as a nearer organ.
TEST(VideoMotion, AZoomedLensIsFoundOutForMostOfTheTime) {
  for (const double zoom : {0.5, 2.0}) {
    LookingAbout about;
    about.lens.fx_px *= zoom;
    about.lens.fy_px *= zoom;
    int differs = 0;
    for (int i = 0; i < 60; ++i) {
      about.look(0.5 * i, 0.5);
      differs += about.motion.state() == VideoAgreement::differs ? 1 : 0;
    }
    EXPECT_GT(differs, 30) << zoom;
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

/// In seconds from zero, by steps of a tenth; 20 where it does not.
double agrees_after_s(LookingAbout& about) {
  int steps = 0;
  do about.look(0.1 * steps++, 0.1);
  while (about.motion.state() != VideoAgreement::agrees && steps < 200);
  return 0.1 * steps;
}

/// As of an appliance that was started anew: the scope is the one that had differed.
TEST(VideoMotion, WhatHasDifferedHasToAgreeTwiceAsOftenThoughTheClockWentBack) {
  LookingAbout fresh;
  const double once_s = agrees_after_s(fresh);
  LookingAbout about;
  about.look(0, 10);
  about.scene_moves = [](double t_s) { return Vector(Vector(9, 9, 0) * std::min(1.0, 3 * (t_s - 10))); };
  about.look(10, 1);
  ASSERT_EQ(about.motion.state(), VideoAgreement::differs);
  about.scene_moves = nullptr;
  const double twice_s = agrees_after_s(about);
  EXPECT_GT(twice_s, once_s);
  EXPECT_LT(twice_s, 20);
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
    // Where it is said to have been measured, the stamps are wrong, by as much as can be seen while the scope is fast.
    if (measured) {
      EXPECT_GT(differs, 15);
    } else {
      EXPECT_EQ(differs, 0);
    }
  }
}

/// As at the board it is calibrated by: the squares look alike, and a swing goes farther than one in a frame.
TEST(VideoMotion, SquaresThatLookAlikeAccuseNobody) {
  LookingAbout about;
  about.board = true;
  about.haste = 8;
  int differs = 0;
  for (int i = 0; i < 16; ++i) {
    about.look(0.25 * i, 0.25);
    differs += about.motion.state() == VideoAgreement::differs ? 1 : 0;
  }
  EXPECT_EQ(differs, 0);
}

/// As a swing from one place to the next: too fast to be followed, from rest to rest.
TEST(VideoMotion, ASwingIsNoHandEyeThatIsOff) {
  for (const double swung_s : {0.1, 0.2, 0.4, 0.8}) {
    LookingAbout about;
    about.swings_s = swung_s;
    int differs = 0, agrees = 0;
    for (int i = 0; i < 40; ++i) {
      about.look(0.5 * i, 0.5);
      differs += about.motion.state() == VideoAgreement::differs ? 1 : 0;
      agrees += about.motion.state() == VideoAgreement::agrees ? 1 : 0;
    }
    EXPECT_EQ(differs, 0) << swung_s;
    EXPECT_GT(agrees, swung_s > 0.3 ? 1 : -1) << swung_s;
  }
}

/// A board whose black squares differ, as by markers.
TEST(VideoMotion, ASwingOverABoardWithMarkersAccusesNobody) {
  for (const auto& [marks, swung_s] : {std::pair{10, 0.2}, {20, 0.2}, {20, 0.4}}) {
    LookingAbout about;
    about.board = true;
    about.marks = marks;
    about.swings_s = swung_s;
    int differs = 0;
    for (int i = 0; i < 8; ++i) {
      about.look(0.5 * i, 0.5);
      differs += about.motion.state() == VideoAgreement::differs ? 1 : 0;
    }
    EXPECT_EQ(differs, 0) << marks << ", " << swung_s;
  }
}

/// As of a transmitter that is bumped. The faster the scope, the less is seen of it: the poses leap while places move.
TEST(VideoMotion, PosesThatLeapWhileTheScopeIsFastAreSeen) {
  for (const double haste : {1.0, 2.0, 3.0})
    for (const double at_s : {10.0, 10.03, 10.06, 10.09}) {
      LookingAbout about;
      about.haste = haste;
      about.look(0, at_s);
      about.bumped_mm = Vector(20, -20, 0);
      bool differs = false;
      for (int i = 0; i < 10; ++i) {
        about.look(at_s + 0.1 * i, 0.1);
        differs = differs || about.motion.state() == VideoAgreement::differs;
      }
      EXPECT_TRUE(differs) << haste << ", " << at_s;
      EXPECT_GE(about.motion.contradictions, 1) << haste << ", " << at_s;
    }
}

/// Also as the picture that is followed is renewed, at the latest each three seconds: no motion may lie between two.
TEST(VideoMotion, ABumpIsSeenWheneverItComes) {
  for (int i = 0; i < 16; ++i) {
    LookingAbout about;
    about.haste = 0.3;
    about.latency_measured = false;
    const double at_s = 4.5 + 0.1 * i;
    about.look(0, at_s);
    about.bumped_mm = Vector(20, -20, 10);
    about.bumped_from_s = at_s;
    about.bumped_over_s = 0.2;
    about.look(at_s, 2);
    EXPECT_GE(about.motion.contradictions, 1) << at_s;
  }
}

/// Places before which nothing moves may be far away, where nobody says that they are not.
TEST(VideoMotion, ABumpAcrossTheViewIsNoFarScene) {
  for (const Vector& bump_mm : {Vector(15, 0, 0), Vector(0, 15, 0), Vector(20, -20, 0)}) {
    LookingAbout about;
    about.motion.farthest_mm = 200;
    about.haste = 0.3;
    about.look(0, 6);
    EXPECT_EQ(about.motion.contradictions, 0);
    about.bumped_mm = bump_mm;
    about.bumped_from_s = 6;
    about.look(6, 2);
    EXPECT_GE(about.motion.contradictions, 1) << bump_mm.transpose();
  }
}

/// A flash between two pictures that are looked at.
TEST(VideoMotion, OneWhiteFrameForgetsNothing) {
  LookingAbout about;
  about.look(0, 10);
  ASSERT_EQ(about.motion.state(), VideoAgreement::agrees);
  int agrees = 0;
  for (int i = 0; i < 24; ++i) {
    about.pattern = i % 8 != 7;
    about.look(10 + 0.04 * i, 0.04);
    agrees += about.motion.state() == VideoAgreement::agrees ? 1 : 0;
  }
  EXPECT_GE(agrees, 12);
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
