#include "host/demo/demo_verdict.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace birdseye::host {
namespace {

/// Of 100 frames, all overlaid but the given number; of those that are, the last `off` are that far off.
DemoFigures overlaid(int off, double off_mm, int without_overlay = 0) {
  DemoFigures out;
  out.frames = 100;
  out.frames_without_overlay = without_overlay;
  const int shown = out.frames - without_overlay;
  for (int i = 0; i < shown; ++i) out.errors.push_back({0.04 * i, i < shown - off ? 1 : off_mm, 5});
  out.deforming = DeformingFigures{5, 7, "found", true, 1, {}};
  return out;
}

bool says(const Verdict& verdict, const std::string& words) {
  for (const std::string& reason : verdict.reasons) {
    if (reason.find(words) != std::string::npos) return true;
  }
  return false;
}

TEST(DemoVerdict, PassesWhereTheTumourIsWithinThreeMillimetresAndSaysSo) {
  const Verdict verdict = demo_verdict(overlaid(20, 2.9));
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_TRUE(says(verdict, "within 2.90 mm in 95 % of the frames; up to 3 mm pass")) << verdict.reasons.front();
}

TEST(DemoVerdict, FollowsWhatNinetyFivePercentOfTheFramesAreOff) {
  EXPECT_EQ(demo_verdict(overlaid(5, 5.5)).grade, Grade::pass);  // the other 95 are 1 mm off
  EXPECT_EQ(demo_verdict(overlaid(6, 4.9)).grade, Grade::marginal);
  EXPECT_EQ(demo_verdict(overlaid(6, 5.1)).grade, Grade::fail);
}

TEST(DemoVerdict, FollowsTheWorstFrame) {
  const Verdict verdict = demo_verdict(overlaid(1, 6.1));
  EXPECT_EQ(verdict.grade, Grade::marginal);
  EXPECT_TRUE(says(verdict, "off by 6.10 mm in the worst frame; up to 6 mm pass"));
  EXPECT_EQ(demo_verdict(overlaid(1, 10.1)).grade, Grade::fail);
}

TEST(DemoVerdict, FailsAnErrorThatIsNotKnown) {
  EXPECT_EQ(demo_verdict(overlaid(100, std::numeric_limits<double>::quiet_NaN())).grade, Grade::fail);
}

TEST(DemoVerdict, FailsWhereNothingIsOverlaidAndWhereNoDeformationWasFound) {
  EXPECT_TRUE(says(demo_verdict(overlaid(0, 0, 100)), "no frame carried an overlay"));
  EXPECT_EQ(demo_verdict(overlaid(0, 0, 100)).grade, Grade::fail);
  DemoFigures not_found = overlaid(0, 0);
  not_found.deforming->found = false;
  not_found.deforming->words = "too few views";
  EXPECT_EQ(demo_verdict(not_found).grade, Grade::fail);
  EXPECT_TRUE(says(demo_verdict(not_found), "the CT was not deformed: too few views"));
}

TEST(DemoVerdict, EachReasonBeginsWithItsGrade) {
  DemoFigures busy = overlaid(0, 0, 60);
  busy.frames_dropped = 10;
  const Verdict verdict = demo_verdict(busy);
  ASSERT_EQ(verdict.reasons.size(), 3U);
  EXPECT_EQ(verdict.reasons[0], "pass: the tumour's centre is within 1.00 mm in 95 % of the frames; up to 3 mm pass");
  EXPECT_EQ(verdict.reasons[1], "fail: 60.0 % of the frames carry no overlay; up to 10 % pass");
  EXPECT_EQ(verdict.reasons[2].find("marginal: 9.1 % of the frames were dropped"), 0U) << verdict.reasons[2];
}

TEST(DemoVerdict, WhereNothingIsOverlaidItSaysWhatElseWasWrong) {
  DemoFigures busy = overlaid(0, 0, 100);
  EXPECT_TRUE(says(demo_verdict(busy), "see birdseyed.log"));
  busy.frames_dropped = 100;
  EXPECT_TRUE(says(demo_verdict(busy), "fail: 50.0 % of the frames were dropped"));
  EXPECT_FALSE(says(demo_verdict(busy), "see birdseyed.log"));
}

TEST(DemoVerdict, CountsFramesWithoutOverlayAndDroppedOnes) {
  EXPECT_EQ(demo_verdict(overlaid(0, 0, 10)).grade, Grade::pass);
  EXPECT_EQ(demo_verdict(overlaid(0, 0, 11)).grade, Grade::marginal);
  EXPECT_EQ(demo_verdict(overlaid(0, 0, 51)).grade, Grade::fail);
  DemoFigures dropped = overlaid(0, 0);
  dropped.frames_dropped = 6;
  EXPECT_EQ(demo_verdict(dropped).grade, Grade::marginal);
  dropped.frames_dropped = 26;
  EXPECT_EQ(demo_verdict(dropped).grade, Grade::fail);
}

}  // namespace
}  // namespace birdseye::host
