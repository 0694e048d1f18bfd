#pragma once

#include <gtest/gtest.h>

#include <string>

#include "drivers/system/wait.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::testing {

/// In the slices of the CT, and waits for it.
inline void pick_landmark(LiveWorkflow& workflow, const Eigen::Vector3d& place_mm) {
  const std::size_t before = workflow.view().landmarks.size();
  workflow.pick(host::PlacePicks::Kind::landmark, place_mm);
  for (int i = 0; i < 1000 && workflow.view().landmarks.size() == before; ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  ASSERT_EQ(workflow.view().landmarks.size(), before + 1);
}

}  // namespace birdseye::testing

namespace birdseye::host {

/// Registered, and before the check.
class Doubted : public ::testing::Test {
 protected:
  void SetUp() override {
    birdseye::testing::load(workflow_);
    birdseye::testing::connect_and_calibrate(workflow_);
    birdseye::testing::Hand hand(workflow_);
    for (const Eigen::Vector3d& fiducial : birdseye::testing::kFiducials) hand.rest_at(fiducial, 80);
    hand.rest_at({0, 0, 200}, 1);
    workflow_.go_to(LiveStep::check);
    ASSERT_TRUE(drawn());
  }
  /// Without video for a while nobody knows what was moved.
  void pause(std::int64_t until_ms = 20'000) {
    wire::VideoFrame frame;
    for (const std::int64_t ms : {until_ms - 20'000, until_ms}) {
      frame.info.acquired = DeviceTime{ms * birdseye::testing::kMs};
      workflow_.take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
    }
    ASSERT_FALSE(drawn());
    ASSERT_EQ(workflow_.view().step, LiveStep::check);
  }
  void pick_landmark(const Eigen::Vector3d& place_mm) { birdseye::testing::pick_landmark(workflow_, place_mm); }
  bool drawn() { return workflow_.picture().setup().has_value(); }
  std::string said() { return workflow_.view().note(LiveStep::check).line; }

  const birdseye::testing::Scratch scratch_;
  LiveWorkflow workflow_{birdseye::testing::operation_settings(scratch_)};
};

}  // namespace birdseye::host
