// Whether the simulator knows by itself when somebody has to look whether the registration holds.
#include "hw-sim/operation/registration_doubts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "hw-sim/operation/operation_laws.hpp"

namespace birdseye::hw_sim {
namespace {

/// A window that draws whatever befalls, by hand.
class DoubtsByTruth : public ::testing::Test {
 protected:
  explicit DoubtsByTruth(bool reference = false) : truth_(1, 96, 72, Happenings(), reference), doubts_(truth_, 0) {
    doubts_.opened();
  }

  void point_at(const Eigen::Vector3d& place_mm, double at_s) { truth_.hand().rest_at(place_mm, at_s); }
  void touch(std::size_t fiducials, double from_s) {
    for (std::size_t i = 0; i < fiducials; ++i) {
      point_at(truth_.fiducials_mm()[i], from_s + 0.1 * static_cast<double>(i));
      (void)draws(from_s + 0.1 * static_cast<double>(i) + 0.05, false);
    }
    point_at({0, 0, 200}, from_s + 0.1 * static_cast<double>(fiducials));
  }
  /// Whether what is on the screen then breaks the law.
  bool draws(double at_s, bool overlaid = true) { return !doubts_.shown(overlaid, at_s).empty(); }
  void look(const Eigen::Vector3d& place_mm, double at_s) {
    point_at(place_mm, at_s - 0.05);
    doubts_.pressed(at_s);
  }
  /// Poses a hundred times a second.
  void poses(double from_s, double until_s, bool with_reference) {
    const int first = static_cast<int>(std::lround(100 * from_s)), last = static_cast<int>(std::lround(100 * until_s));
    for (int n = first; n < last; ++n) {
      const double at_s = n * 0.01;
      wire::Birds birds;
      birds.acquired = DeviceTime{static_cast<std::int64_t>(at_s * 1e9)};
      birds.birds.push_back({"scope", truth_.tracker_from_sensor(0, at_s)});
      if (with_reference) birds.birds.push_back({kReference, truth_.tracker_from_sensor(0, at_s)});
      doubts_.take(birds, at_s);
    }
  }
  void tell_of_reference() {
    wire::Health health;
    health.reference = kReference;
    doubts_.take(health, 0);
  }

  OperationTruth truth_;
  RegistrationDoubts doubts_;
};

class DoubtsWithReference : public DoubtsByTruth {
 protected:
  DoubtsWithReference() : DoubtsByTruth(true) {
    tell_of_reference();
    touch(3, 1);
    poses(1, 5, true);
    EXPECT_FALSE(draws(5));
  }
};

TEST_F(DoubtsByTruth, ThreeTouchesEndItAndTwoDoNot) {
  touch(2, 1);
  EXPECT_TRUE(draws(2));
  touch(3, 3);
  EXPECT_FALSE(draws(4));
  EXPECT_EQ(doubts_.figures().at("window_opened").began, 1U);
  EXPECT_EQ(doubts_.figures().at("window_opened").judged, 1U);
}

TEST_F(DoubtsByTruth, AWindowThatIsOpenedAgainDrawsNothingBeforeTwoPlacesAreLookedAt) {
  touch(3, 1);
  EXPECT_FALSE(draws(2));
  doubts_.opened();
  EXPECT_TRUE(draws(3));
  look({0, 0, 200}, 4);
  look(truth_.target_mm(), 5);
  look(truth_.target_mm(), 6);
  EXPECT_TRUE(draws(6.1)) << "one place, twice";
  look(truth_.fiducials_mm().front(), 7);
  EXPECT_FALSE(draws(7.1));
}

TEST_F(DoubtsByTruth, WithoutVideoForTenSecondsItIsInDoubt) {
  touch(3, 1);
  doubts_.take(wire::VideoFrame(), 2);
  EXPECT_FALSE(draws(2));
  doubts_.take(wire::VideoFrame(), 11.9);
  EXPECT_FALSE(draws(12));
  doubts_.take(wire::VideoFrame(), 22.1);
  EXPECT_TRUE(draws(22.1));
}

TEST_F(DoubtsByTruth, AScopeThatWasAwayWhileSomebodyPointedHasLonger) {
  for (const bool pointed : {true, false}) {
    touch(3, 1);
    (void)draws(2);
    poses(2.5, 2.6, false);
    if (pointed) look(truth_.target_mm(), 8);
    point_at({0, 0, 200}, 9);
    poses(20, 20.1, false);
    EXPECT_EQ(draws(20.1), !pointed);
    doubts_.opened();
  }
}

TEST_F(DoubtsWithReference, AReferenceThatWasNotSeenPutsItInDoubt) {
  poses(5.1, 6, true);
  EXPECT_FALSE(draws(6)) << "a few records may be damaged";
  poses(6, 6.3, false);
  EXPECT_TRUE(draws(6.3));
  poses(6.3, 7, true);
  EXPECT_TRUE(draws(7)) << "it is seen again, and may have been moved meanwhile";
}

TEST_F(DoubtsWithReference, AReferenceThatSlipsPutsItInDoubtOnceItHasToBeSeen) {
  doubts_.come_off(6, 6.1);
  poses(5, 6.25, true);
  EXPECT_FALSE(draws(6.25));
  poses(6.25, 6.4, true);
  EXPECT_TRUE(draws(6.4));
  look(truth_.target_mm(), 8);
  look(truth_.fiducials_mm().front(), 9);
  EXPECT_FALSE(draws(9.1)) << "somebody has looked";
  EXPECT_EQ(doubts_.figures().at("reference_slipped").judged, 1U);
}

TEST_F(DoubtsWithReference, AWindowThatLearnsOfTheReferenceLaterNeedNotHaveSeenTheSlip) {
  doubts_.opened();
  touch(3, 5);
  poses(5, 6.2, true);
  tell_of_reference();
  doubts_.come_off(6, 6.1);
  poses(6.2, 7, true);
  EXPECT_FALSE(draws(7));
}

/// The window forgets to doubt, says so nowhere, and goes on drawing.
TEST(OperationLaws, AnOverlayThatGoesOnAfterTheReferenceHasSlippedIsFound) {
  FaultScript faults;
  faults.world.push_back({FaultKind::reference_moved, 6, {}, {{"mm", 10}, {"deg", 10}, {"over_s", 0.1}}});
  // Hides how another one is seen.
  faults.world.push_back({FaultKind::reference_moved, 20, {}, {{"mm", 10}, {"deg", 10}, {"over_s", 0.1}}});
  faults.tracker.push_back({FaultKind::drop_byte, 18, 4.0, {{"chance", 0.2}}});
  OperationTruth truth(1, 96, 72, Happenings(faults.world), true);
  OperationLaws laws(
      truth, faults, [](std::uint64_t sequence) { return static_cast<std::int64_t>(sequence) * 1'000'000; }, 0);
  laws.opened(0);
  wire::Health health;
  health.reference = kReference;
  laws.take(health, HostTime{0});
  const calibration::CalibrationRecord& record = truth.record_of(0);
  host::LivePicture picture;
  picture.set_setup(host::ScopeSetup::of_record(record)->registered(truth.tracker_from_patient(0)), {});
  host::ShownPicture shown;
  shown.any = shown.overlaid = true;
  shown.strength = 1;
  const auto broken_at = [&](std::int64_t now_ms) {
    wire::Birds birds;
    birds.acquired = DeviceTime{now_ms * 1'000'000};
    for (const auto& [bird, name] : {std::pair{0, "scope"}, {1, "pointer"}, {2, kReference}})
      birds.birds.push_back(
          {name, truth.tracker_from_sensor(static_cast<std::size_t>(bird), static_cast<double>(now_ms) * 1e-3)});
    const HostTime now{now_ms * 1'000'000};
    laws.take(birds, now);
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(now_ms);
    picture.take(frame, {now});
    laws.take(shown, picture, now);
    return std::ranges::count(laws.broken(), "setup", &BrokenLaw::law);
  };
  const auto touch_all = [&](std::int64_t from_ms) {
    shown.overlaid = false;
    for (const Eigen::Vector3d& place_mm : truth.fiducials_mm()) {
      truth.hand().rest_at(place_mm, static_cast<double>(from_ms) * 1e-3);
      (void)broken_at(from_ms += 20);
    }
    shown.overlaid = true;
  };
  touch_all(1000);
  for (std::int64_t now_ms = 1200; now_ms <= 6240; now_ms += 20) ASSERT_EQ(broken_at(now_ms), 0) << now_ms;
  for (std::int64_t now_ms = 6260; now_ms <= 6400; now_ms += 20) (void)broken_at(now_ms);
  const auto broken = broken_at(6420);
  EXPECT_GE(broken, 5);
  EXPECT_NE(laws.broken().back().what.find("reference_slipped"), std::string::npos) << laws.broken().back().what;
  touch_all(7000);
  for (std::int64_t now_ms = 7200; now_ms <= 21000; now_ms += 20) ASSERT_EQ(broken_at(now_ms), broken) << now_ms;
  laws.finish(22);
  EXPECT_EQ(laws.figures().by_fault.at("doubt reference_slipped").judged, 1U);
}

/// The lens is that of the scope in use, and hand-eye is the former's.
TEST(OperationLaws, AnOverlayByTheHandEyeOfAnotherScopeIsFound) {
  OperationTruth truth(1, 96, 72, Happenings(), false);
  OperationLaws laws(
      truth, {}, [](std::uint64_t) { return 1'000'000'000; }, 0);
  host::ShownPicture shown;
  shown.any = shown.overlaid = true;
  shown.strength = 1;
  const auto broken_with = [&](std::size_t lens, std::size_t hand_eye) {
    calibration::CalibrationRecord record = truth.record_of(hand_eye);
    record.lens = truth.record_of(lens).lens;
    host::LivePicture picture;
    picture.set_setup(host::ScopeSetup::of_record(record)->registered(truth.tracker_from_patient(1)), {});
    picture.take(wire::VideoFrame(), {HostTime{1'000'000'000}});
    laws.take(shown, picture, HostTime{1'020'000'000});
    return laws.broken().size();
  };
  EXPECT_EQ(broken_with(0, 0), 0U);
  EXPECT_EQ(broken_with(0, 1), 1U);
  EXPECT_EQ(broken_with(1, 0), 2U);
}

}  // namespace
}  // namespace birdseye::hw_sim
