// That the video is watched whatever step is open, and what holds where it was not.
#include <gtest/gtest.h>

#include "calibration/geometry/rotations.hpp"
#include "tests/host/operation/lies.hpp"

namespace birdseye::testing {
namespace {

using host::LiveStep;

void bump_transmitter(Rehearsal& o) {
  o.truth.told_from_tracker =
      Transform<Tracker, Tracker>(rotation_exp(Eigen::Vector3d(0.06, 0.02, -0.05)), Eigen::Vector3d(12, -10, 8));
}

/// Before a running overlay, without a reference.
void run(Rehearsal& o) {
  ASSERT_TRUE(o.begin() && o.register_patient() && o.check());
  o.watch(0.4);
  ASSERT_GT(o.watch(1).green.size(), 20U);
}

TEST(WatchedSteps, ABumpTakesTheOverlayAwayInEachOfThem) {
  for (const LiveStep step : {LiveStep::calibrate, LiveStep::fiducials, LiveStep::views, LiveStep::run}) {
    Rehearsal o(1);
    run(o);
    o.workflow().go_to(step);
    o.watch(0.2);
    bump_transmitter(o);
    EXPECT_LT(o.watch(5).last_green_s, 1) << host::name_of(step);
    EXPECT_TRUE(o.workflow().view().unconfirmed) << host::name_of(step);
  }
}

TEST(WatchedSteps, AfterAWhileWithoutTheRecordNothingIsDrawnBeforeSomebodyHasLooked) {
  for (const double away_s : {1.0, 12.0}) {
    Rehearsal o(1);
    run(o);
    const auto camera = o.camera;
    o.camera["serial"] = "B2";
    o.tell_instruments();
    o.give_record();
    o.watch(0.5);
    bump_transmitter(o);
    EXPECT_TRUE(o.watch(away_s).green.empty());
    o.camera = camera;
    o.tell_instruments();
    o.give_record();
    EXPECT_TRUE(o.watch(0.5).green.empty()) << "what agreed before tells nothing of now; away for " << away_s << " s";
    if (away_s < 10) continue;
    o.look_about();
    EXPECT_TRUE(o.watch(5).green.empty()) << "nobody watched for " << away_s << " s";
    EXPECT_TRUE(o.workflow().view().unconfirmed);
  }
}

}  // namespace
}  // namespace birdseye::testing
