#include "host/link/drops.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

using ::testing::ElementsAre;

TEST(Drops, NoneAreNotTold) {
  EXPECT_EQ(Drops().words(), "");
  Verdict verdict;
  Drops().tell(verdict);
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_TRUE(verdict.reasons.empty());
}

TEST(Drops, FramesAreToldAndPosesMakeItMarginal) {
  Verdict frames_only;
  Drops{3, 0}.tell(frames_only);
  EXPECT_EQ(frames_only.grade, Grade::pass);
  EXPECT_THAT(frames_only.reasons,
              ElementsAre("this machine fell behind, so 3 frames and 0 other messages were dropped"));
  Verdict both;
  Drops{3, 2}.tell(both);
  EXPECT_EQ(both.grade, Grade::marginal);
  EXPECT_THAT(both.reasons, ElementsAre("this machine fell behind, so 3 frames and 2 other messages were dropped"));
  Verdict failed;
  failed.add(Grade::fail, "off by 9 mm");
  Drops{0, 1}.tell(failed);
  EXPECT_EQ(failed.grade, Grade::fail);
}

}  // namespace
}  // namespace birdseye::host
