#include "host/calibrate/hand_eye_solution.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Of a recording whose rests show another pattern there is no lens either, and more stations would not mend that.
TEST(HandEyeSolution, WithoutAnyStationAsksWhetherTheBoardIsTheOneInThePictures) {
  HandEyeRecording recording;
  recording.camera_verdict.add(Grade::fail, "no lens was found: too few views",
                               "hold the scope still at more stations");
  const auto found = solve_hand_eye(recording, {}, false);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->verdict.grade, Grade::fail);
  EXPECT_THAT(found->verdict.reasons, Contains(HasSubstr("no lens was found")));
  EXPECT_THAT(found->verdict.next_steps, Contains(HasSubstr("see that --board names the pattern")));
}

}  // namespace
}  // namespace birdseye::host
