#include "calibration/base/verdict.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace birdseye {
namespace {

std::string reason(double value, double pass_up_to, double marginal_up_to) {
  Verdict verdict;
  verdict.judge("error", value, "mm", pass_up_to, marginal_up_to, "again");
  return std::string(name_of(verdict.grade)) + ": " + verdict.reasons.at(0);
}

TEST(Verdict, NamesTheFigureAndTheLimitThatItKeepsOrPasses) {
  EXPECT_EQ(reason(1.2, 2, 5), "pass: error 1.20 mm, of at most 2.00");
  EXPECT_EQ(reason(3, 2, 5), "marginal: error 3.00 mm, more than 2.00");
  EXPECT_EQ(reason(6, 2, 5), "fail: error 6.00 mm, more than 5.00");
  EXPECT_EQ(reason(0, 0, 0), "pass: error 0.00 mm, of at most 0.00");
}

TEST(Verdict, ShowsDigitsEnoughOfASmallLimitAndToTellAFigureFromIt) {
  EXPECT_EQ(reason(0.0004, 1e-3, 1e-3), "pass: error 0.0004 mm, of at most 0.0010");
  EXPECT_EQ(reason(0.02, 1.5e-3, 1.5e-3), "fail: error 0.0200 mm, more than 0.0015");
  EXPECT_EQ(reason(1.003, 1, 2), "marginal: error 1.003 mm, more than 1.000");
  EXPECT_EQ(reason(2, 2, 5), "pass: error 2.00 mm, of at most 2.00");
}

TEST(Verdict, AFigureThatIsNoNumberFails) {
  EXPECT_EQ(reason(std::numeric_limits<double>::quiet_NaN(), 2, 5).substr(0, 5), "fail:");
}

TEST(Verdict, KeepsTheWorstGradeAndEachNextStepOnce) {
  Verdict verdict;
  verdict.judge("one", 3, "mm", 2, 5, "again");
  verdict.judge("two", 6, "mm", 2, 5, "again");
  verdict.judge("three", 1, "mm", 2, 5, "never said");
  EXPECT_EQ(verdict.grade, Grade::fail);
  EXPECT_EQ(verdict.reasons.size(), 3U);
  EXPECT_EQ(verdict.next_steps, std::vector<std::string>{"again"});
}

}  // namespace
}  // namespace birdseye
