// Which of two recordings of one motion is in another unit of time than it was read in.
#include "host/calibrate/time_hint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Poses at so many seconds each, from a first one on.
PoseSet poses(double from_s, double step_s, int count, double in_units_of_s = 1) {
  PoseSet set;
  set.timed = true;
  for (int i = 0; i < count; ++i) set.poses.emplace_back().time_s = (from_s + i * step_s) / in_units_of_s;
  return set;
}

std::string hint(const PoseSet& a, const PoseSet& b, double a_s_per_unit = 1, double b_s_per_unit = 1) {
  return hint_on_time_units({"sensor.csv", "--time-unit", a, a_s_per_unit},
                            {"eye.csv", "--eye-time-unit", b, b_s_per_unit});
}

TEST(TimeHint, NamesTheFileItsUnitAndTheOption) {
  const PoseSet sensor = poses(1000, 0.01, 3000), eye = poses(1002, 0.04, 700);
  const std::string milliseconds = hint(sensor, poses(1002, 0.04, 700, 1e-3));
  EXPECT_THAT(milliseconds, HasSubstr("eye.csv seem to be in milliseconds, not in seconds"));
  EXPECT_THAT(milliseconds, HasSubstr("from 1002.000 to 1029.960 s"));
  EXPECT_THAT(milliseconds, HasSubstr("say --eye-time-unit ms"));
  EXPECT_THAT(hint(poses(1000, 0.01, 3000, 1e-6), eye), HasSubstr("say --time-unit us"));
  EXPECT_THAT(hint(sensor, poses(1002, 0.04, 700, 1e-9)), HasSubstr("say --eye-time-unit ns"));
  EXPECT_THAT(hint(poses(0, 0.01, 3000), poses(0, 0.04, 700, 1e-3)), HasSubstr("say --eye-time-unit ms"))
      << "both begin at 0, and overlap as they are";
}

TEST(TimeHint, AUnitThatWasSaidOfBothMayBeWrongOfOne) {
  const PoseSet sensor = poses(1, 1e-5, 3000), eye = poses(1000, 0.04, 700);
  EXPECT_THAT(hint(sensor, eye, 1e-3, 1e-3), HasSubstr("sensor.csv seem to be in seconds, not in "
                                                       "milliseconds"));
}

TEST(TimeHint, SaysNothingWhereUnitsAreNotTheFault) {
  EXPECT_THAT(hint(poses(1000, 0.01, 3000), poses(1002, 0.04, 700)), IsEmpty());
  EXPECT_THAT(hint(poses(1000, 0.01, 3000), poses(5000, 0.04, 700)), IsEmpty()) << "another day";
  EXPECT_THAT(hint(poses(1000, 0.01, 3000), poses(9000, 0.04, 700, 1e-3)), IsEmpty());
  EXPECT_THAT(hint(poses(1000, 0.01, 3000), PoseSet{}), IsEmpty());
}

}  // namespace
}  // namespace birdseye::host
