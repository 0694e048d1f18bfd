// What brings a registration back that something has spoken against.
#include <gtest/gtest.h>

#include <array>

#include "tests/host/operation/doubted_fixture.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::check_at;
using birdseye::testing::confirm;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kTumour;

TEST_F(Doubted, IsNotConfirmedByWhatThePointerDidBefore) {
  Hand(workflow_).rest_at(kTumour, 5);
  pause();
  workflow_.primary(HostTime{0});
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("the pointer is not seen"), std::string::npos) << said();
}

TEST_F(Doubted, IsNotConfirmedAwayFromEveryLandmarkHoweverFar) {
  for (const double beside_mm : {9.0, 15.0, 31.0, 200.0}) {
    pause();
    check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, beside_mm));
    EXPECT_FALSE(drawn()) << beside_mm;
    EXPECT_NE(said().find("not confirmed"), std::string::npos) << said();
    workflow_.go_on();
    EXPECT_FALSE(drawn()) << "nor by going on";
    workflow_.go_to(LiveStep::run);
    EXPECT_FALSE(drawn());
    workflow_.go_to(LiveStep::check);
  }
  confirm(workflow_, {0, 0, 7});
  EXPECT_TRUE(drawn()) << said();
}

TEST_F(Doubted, IsConfirmedByAFiducialThatStillFitsAndNotByOneThatDoesNot) {
  pause();
  check_at(workflow_, kFiducials[1] + Eigen::Vector3d(0, 12, 0));
  EXPECT_FALSE(drawn());
  check_at(workflow_, kFiducials[0] + Eigen::Vector3d(0, 1, 0));
  EXPECT_FALSE(drawn()) << "one place may be another's";
  EXPECT_NE(said().find("1.0 mm from fiducial 1: it fits there"), std::string::npos) << said();
  workflow_.primary(HostTime{0});
  EXPECT_FALSE(drawn()) << "the same again is none more";
  check_at(workflow_, kFiducials[1] + Eigen::Vector3d(0, 1, 0));
  EXPECT_TRUE(drawn());
  EXPECT_FALSE(workflow_.view().checked) << "the registration was fitted to it";
  EXPECT_NE(said().find("1.0 mm from fiducial 2"), std::string::npos) << said();
}

/// The tracker has fallen silent, and the video goes on.
TEST_F(Doubted, IsNotConfirmedByAPointerThatIsNotSeenAnyMore) {
  pause();
  Hand(workflow_).rest_at(kTumour, 5);
  workflow_.primary(HostTime{60'000 * birdseye::testing::kMs});
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("the pointer is not seen"), std::string::npos) << said();
}

/// Over a slow network: where the pointer was is not where it is.
TEST_F(Doubted, IsNeitherConfirmedNorTouchedByAPointerThatComesLate) {
  pause();
  const auto late_at = [&](const Eigen::Vector3d& in_patient_mm, std::int64_t from_ms) {
    for (std::int64_t ms = from_ms; ms < from_ms + 800; ms += 10) {
      wire::Birds birds;
      birds.acquired = DeviceTime{ms * birdseye::testing::kMs};
      const Eigen::Vector3d sensor_mm =
          birdseye::testing::kTrackerFromPatient * in_patient_mm - Eigen::Vector3d(0, 0, 150);
      birds.birds.push_back({"pointer", Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), sensor_mm)});
      workflow_.take(birds, HostTime{(ms + 600) * birdseye::testing::kMs}, ClockGap{});
    }
  };
  late_at(kTumour, 21'000);
  workflow_.primary(HostTime{22'400 * birdseye::testing::kMs});
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("the pointer is not seen"), std::string::npos) << said();
  workflow_.go_to(LiveStep::fiducials);
  const std::size_t before = workflow_.view().touches.size();
  late_at(kFiducials[0], 23'000);
  late_at(kFiducials[1], 24'000);
  late_at(kFiducials[2], 25'000);
  late_at(kFiducials[3], 26'000);
  EXPECT_EQ(workflow_.view().touches.size(), before);
}

/// The tracker was away, and the video went on.
TEST_F(Doubted, IsARegistrationWhoseScopeWasNotSeenForAWhile) {
  wire::Birds birds;
  birds.birds.push_back({"scope", Transform<Tracker, Sensor>()});
  for (std::int64_t ms = 0; ms <= 20'000; ms += 1000) {
    const bool tracked = ms == 0 || ms == 20'000;
    ASSERT_TRUE(drawn()) << ms;
    wire::VideoFrame frame;
    frame.info.acquired = birds.acquired = DeviceTime{ms * birdseye::testing::kMs};
    workflow_.take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
    if (tracked) workflow_.take(birds, HostTime{frame.info.acquired.ns}, ClockGap{});
  }
  EXPECT_FALSE(drawn());
  EXPECT_EQ(workflow_.view().step, LiveStep::check);
}

/// What a person has seen to be off by so much is not expected to be off by less.
TEST_F(Doubted, IsConfirmedNoBetterThanItsLandmarksFit) {
  const auto expected_mm = [&] { return workflow_.picture().figures().target_mm.value_or(0); };
  const double by_touches_mm = expected_mm();
  ASSERT_LT(by_touches_mm, 1);
  pause();
  confirm(workflow_, {0, 0, 6});
  ASSERT_TRUE(drawn()) << said();
  EXPECT_NEAR(expected_mm(), 6, 0.5);
  workflow_.go_to(LiveStep::check);
  check_at(workflow_, kFiducials[3]);
  EXPECT_NEAR(expected_mm(), 6, 0.5) << "the other places are off as they were";
  auto anew = birdseye::testing::straight_scope_record();
  anew.hand_eye->camera_from_sensor = Transform<Camera, Sensor>(
      anew.hand_eye->camera_from_sensor.rotation(),
      Eigen::Vector3d(anew.hand_eye->camera_from_sensor.translation() + Eigen::Vector3d(0, 0, 1)));
  birdseye::testing::give_record(workflow_, anew);
  ASSERT_TRUE(drawn());
  EXPECT_NEAR(expected_mm(), 6, 0.5) << "another calibration does not register the patient";
  pause();
  confirm(workflow_);
  EXPECT_NEAR(expected_mm(), by_touches_mm, 0.5) << "the last look at a place counts";
}

/// The scope lies aside while the fiducials are touched.
TEST_F(Doubted, IsNotARegistrationThatWasMadeWhileTheScopeWasAway) {
  wire::Birds birds;
  birds.birds.push_back({"scope", Transform<Tracker, Sensor>()});
  const auto seen_at = [&](std::int64_t ms) {
    birds.acquired = DeviceTime{ms * birdseye::testing::kMs};
    workflow_.take(birds, HostTime{birds.acquired.ns}, ClockGap{});
  };
  seen_at(0);
  workflow_.go_to(LiveStep::fiducials);
  workflow_.undo();
  Hand hand(workflow_);
  hand.rest_at({0, 0, 200}, 1);
  hand.rest_at(kFiducials.back(), 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(drawn());
  seen_at(60'000);
  EXPECT_TRUE(drawn()) << said();
}

TEST_F(Doubted, IsARegistrationWhoseScopeCameLongAfterIt) {
  wire::Birds birds;
  birds.birds.push_back({"scope", Transform<Tracker, Sensor>()});
  check_at(workflow_, kTumour);
  ASSERT_TRUE(drawn());
  birds.acquired = DeviceTime{600'000 * birdseye::testing::kMs};
  workflow_.take(birds, HostTime{birds.acquired.ns}, ClockGap{});
  EXPECT_FALSE(drawn()) << "nobody has seen for ten minutes what was moved";
}

/// A landmark that is picked where the tip is shown fits whatever has moved.
TEST_F(Doubted, IsNotConfirmedByLandmarksThatWerePickedSinceThoughOthersWereTakenBack) {
  pick_landmark({20, 20, 10});
  pick_landmark({40, 40, 10});
  pause();
  workflow_.undo();
  workflow_.undo();
  for (const Eigen::Vector3d& picked : {Eigen::Vector3d(-20, 20, 75), Eigen::Vector3d(40, -30, 75)}) {
    pick_landmark(picked);
    check_at(workflow_, picked);
  }
  EXPECT_FALSE(drawn()) << said();
}

TEST_F(Doubted, IsNotConfirmedByLandmarksThatWerePickedBeforeItWasDoubtedAgain) {
  pause();
  const std::array picked{Eigen::Vector3d(-20, 20, 75), Eigen::Vector3d(40, -30, 75)};
  for (const Eigen::Vector3d& place : picked) pick_landmark(place);
  pause(40'000);
  for (const Eigen::Vector3d& place : picked) check_at(workflow_, place);
  EXPECT_FALSE(drawn()) << said();
}

/// Touches that were held back and then doubted are gone, and hold nothing up any more.
TEST_F(Doubted, AreTouchesThatWereHeldBackAndNothingIsHeldBackAfter) {
  workflow_.go_to(LiveStep::fiducials);
  while (workflow_.view().touches.size() > 2) workflow_.undo();
  const auto show_frame = [&](std::int64_t ms) {
    wire::VideoFrame frame;
    frame.info.acquired = DeviceTime{ms * birdseye::testing::kMs};
    workflow_.take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
  };
  const auto come_again = [&] {
    workflow_.set_link(false, "gone");
    workflow_.set_link(true, "again");
    birdseye::testing::tell_health(workflow_);
    birdseye::testing::give_record(workflow_);
    workflow_.set_link(true, "again");
  };
  show_frame(0);
  workflow_.set_link(false, "gone");
  show_frame(20'000);
  come_again();
  EXPECT_TRUE(workflow_.view().touches.empty());
  workflow_.go_to(LiveStep::fiducials);
  Hand hand(workflow_);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(drawn());
  workflow_.go_to(LiveStep::run);
  come_again();
  EXPECT_EQ(workflow_.view().step, LiveStep::run);
}

TEST_F(Doubted, IsBegunAnewByThePedalInTheStepOfFiducials) {
  pause();
  workflow_.go_to(LiveStep::fiducials);
  Hand(workflow_).rest_at(kFiducials[0], 10);
  workflow_.primary(HostTime{0});
  EXPECT_EQ(workflow_.view().step, LiveStep::fiducials);
  EXPECT_EQ(workflow_.view().touches.size(), 1U);
}

/// A fitted fiducial that is nearer than the landmark hides nothing.
TEST_F(Doubted, IsARegistrationWhoseTouchedFiducialDoesNotFit) {
  check_at(workflow_, kFiducials[3] + Eigen::Vector3d(0, 0, 13));
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("13 mm from fiducial 4"), std::string::npos) << said();
}

TEST_F(Doubted, IsMadeAnewByTouches) {
  pause();
  workflow_.go_to(LiveStep::fiducials);
  Hand hand(workflow_);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_TRUE(drawn());
}

TEST_F(Doubted, IsNotTouchedAnewWhereThePointerRestedToCheck) {
  pause();
  Hand hand(workflow_);
  hand.rest_at(kTumour + Eigen::Vector3d(0, 0, 12), 80);
  workflow_.primary(HostTime{0});
  ASSERT_FALSE(drawn());
  workflow_.go_to(LiveStep::fiducials);
  hand.rest_at(kFiducials[0], 80);
  hand.rest_at(kFiducials[1], 1);
  EXPECT_EQ(workflow_.view().touches.size(), 1U);
}

TEST_F(Doubted, AreTouchesThatGaveNoRegistrationYet) {
  workflow_.go_to(LiveStep::fiducials);
  while (workflow_.view().touches.size() > 2) workflow_.undo();
  ASSERT_EQ(workflow_.view().touches.size(), 2U);
  wire::VideoFrame frame;
  for (const std::int64_t ms : {0, 20'000}) {
    frame.info.acquired = DeviceTime{ms * birdseye::testing::kMs};
    workflow_.take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
  }
  EXPECT_TRUE(workflow_.view().touches.empty());
  EXPECT_NE(workflow_.view().note(LiveStep::fiducials).line.find("touch all fiducials anew"), std::string::npos);
}

/// A first check that shows the target beside its place speaks against the registration, whatever is pressed then.
TEST_F(Doubted, IsARegistrationWhoseFirstLandmarkDoesNotFit) {
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("12 mm from tumour"), std::string::npos) << said();
  check_at(workflow_, {0, 0, 200});
  EXPECT_FALSE(drawn());
  confirm(workflow_);
  EXPECT_TRUE(drawn()) << said();
  EXPECT_TRUE(workflow_.view().checked);
}

TEST_F(Doubted, IsALaterLandmarkThatDoesNotFitAndTheFormerCountsNoMore) {
  check_at(workflow_, kTumour);
  ASSERT_TRUE(workflow_.view().checked);
  workflow_.go_to(LiveStep::check);
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  EXPECT_FALSE(drawn());
  EXPECT_FALSE(workflow_.view().checked);
}

/// Fiducials fit because they were made to fit: the skin may have shifted with them.
TEST_F(Doubted, IsNotConfirmedByFittedFiducialsWhereALandmarkWasOff) {
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  ASSERT_FALSE(drawn());
  check_at(workflow_, kFiducials[0]);
  check_at(workflow_, kFiducials[1]);
  EXPECT_FALSE(drawn()) << said();
  EXPECT_NE(said().find("but tumour was off"), std::string::npos) << said();
  check_at(workflow_, kTumour);
  EXPECT_TRUE(drawn()) << said();
}

/// Each landmark that was off has to be found to fit, and what was far from all was not pointed at.
TEST_F(Doubted, IsNotConfirmedByOneOfTwoLandmarksThatWereOff) {
  pick_landmark({20, 20, 10});
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  check_at(workflow_, Eigen::Vector3d(20, 20, 10) + Eigen::Vector3d(0, 0, -12));
  ASSERT_FALSE(drawn());
  check_at(workflow_, Eigen::Vector3d(20, 20, 10));
  check_at(workflow_, kFiducials[1]);
  EXPECT_FALSE(drawn()) << said();
  check_at(workflow_, kTumour);
  check_at(workflow_, kFiducials[1]);
  EXPECT_TRUE(drawn()) << said();
}

TEST_F(Doubted, IsNotRefusedByALandmarkThatWasNotPointedAt) {
  pause();
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 60));
  ASSERT_FALSE(drawn());
  check_at(workflow_, kFiducials[0]);
  check_at(workflow_, kFiducials[1]);
  EXPECT_TRUE(drawn()) << said();
}

TEST_F(Doubted, IsOffWhereALandmarkWasOffWhateverWasDoubtedSince) {
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 7.5));
  ASSERT_TRUE(drawn());
  pause();
  check_at(workflow_, kFiducials[0]);
  check_at(workflow_, kFiducials[1]);
  ASSERT_TRUE(drawn()) << said();
  EXPECT_NEAR(workflow_.picture().figures().target_mm.value_or(0), 7.5, 0.1);
}

/// What was touched ten minutes ago nobody has just seen.
TEST_F(Doubted, IsARegistrationThatIsFittedAnewLongAfterItsTouches) {
  workflow_.go_to(LiveStep::run);
  wire::Birds birds;
  birds.birds.push_back({"scope", Transform<Tracker, Sensor>()});
  const auto seen_at = [&](std::int64_t s) {
    birds.acquired = DeviceTime{1000 * s * birdseye::testing::kMs};
    workflow_.take(birds, HostTime{birds.acquired.ns}, ClockGap{});
  };
  seen_at(10);
  wire::VideoFrame frame;
  for (std::int64_t s = 11; s <= 600; ++s) {
    frame.info.acquired = DeviceTime{1000 * s * birdseye::testing::kMs};
    workflow_.take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
  }
  workflow_.go_to(LiveStep::fiducials);
  for (int asked = 0; asked < 2 && workflow_.view().touches.size() == 4; ++asked) workflow_.take_back(3);
  ASSERT_EQ(workflow_.view().touches.size(), 3U);
  seen_at(605);
  EXPECT_FALSE(drawn()) << "the scope was away for ten minutes";
}

/// What fitted one registration tells nothing of another.
TEST_F(Doubted, IsNotConfirmedByAPlaceThatFittedAFormerFit) {
  pause();
  check_at(workflow_, kFiducials[0]);
  ASSERT_TRUE(workflow_.view().fits_at_one);
  workflow_.go_to(LiveStep::fiducials);
  for (int asked = 0; asked < 2 && workflow_.view().touches.size() == 4; ++asked) workflow_.take_back(3);
  EXPECT_FALSE(workflow_.view().fits_at_one);
}

TEST_F(Doubted, EndsAStroke) {
  workflow_.go_to(LiveStep::views);
  workflow_.stroke();
  ASSERT_TRUE(workflow_.view().stroking);
  pause();
  EXPECT_FALSE(workflow_.view().stroking) << "the way to a landmark is no organ's surface";
}

TEST_F(Doubted, IsARegistrationWhoseMachineSlept) {
  workflow_.note_sleep(Duration::from_ms(500));
  workflow_.note_sleep(Duration::from_ms(900));
  EXPECT_TRUE(drawn());
  workflow_.note_sleep(Duration::from_ms(600'000));
  EXPECT_FALSE(drawn());
  EXPECT_EQ(workflow_.view().step, LiveStep::check);
}

/// Of a registration that nothing speaks against nobody has to look.
TEST_F(Doubted, IsNotARegistrationOfWhichNobodyLooked) {
  check_at(workflow_, {0, 0, 200});
  EXPECT_TRUE(drawn());
  EXPECT_EQ(workflow_.view().step, LiveStep::run);
  EXPECT_EQ(said(), "gone on without a landmark");
}

/// Without the deformation, or with another, nobody has looked whether the landmark fits.
TEST(PlacesOff, ALandmarkThatRefusesStillDoesWhereTheDeformationGoes) {
  PlacesOff off;
  off.note({kTumour, "tumour", 12, true, true});
  off.note({kFiducials[0], "fiducial 1", 3, true, false});
  off.forget_but_refusing();
  off.forget_deformed();
  ASSERT_EQ(off.all().size(), 1U);
  ASSERT_NE(off.refusing(), nullptr);
  EXPECT_FALSE(off.refusing()->deformed);
  off.note({kTumour, "tumour", 1, true, false});
  EXPECT_EQ(off.refusing(), nullptr) << "it fits, by whichever CT";
}

}  // namespace
}  // namespace birdseye::host
