#include "calibration/field/field_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {
namespace {

std::vector<CheckedPlace> touched(unsigned seed, double noise_mm, double scale = 1) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  const Eigen::Matrix3d turn = rotation_exp({0.1, 2, -0.4});
  std::vector<CheckedPlace> out;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d place(80 * (i % 3), 110 * (i / 3), i == 4 ? 30 : 0);
    out.push_back({"divot " + std::to_string(i + 1), place,
                   scale * (turn * place) + Eigen::Vector3d(300 + noise(rng), noise(rng), noise(rng) - 40)});
  }
  return out;
}

std::vector<FieldCheck> days(const std::vector<double>& rms_mm) {
  std::vector<FieldCheck> out;
  for (const double value : rms_mm) out.push_back({"a day", value, 0.1, value, "divot 1", {}});
  return out;
}

const std::vector<double> kUsual{0.50, 0.60, 0.45, 0.55, 0.65, 0.50, 0.40, 0.55};  // mean 0.525

std::vector<double> after_usual(const std::vector<double>& more) {
  std::vector<double> all = kUsual;
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(FieldCheck, SaysHowFarThePlateIsOff) {
  const auto exact = check_field("today", touched(1, 0));
  ASSERT_TRUE(exact);
  EXPECT_LT(exact->rms_mm, 1e-9);
  EXPECT_NEAR(exact->scale_percent, 0, 1e-9);
  EXPECT_NEAR(check_field("today", touched(1, 0, 1.02))->scale_percent, 2, 1e-9);
  auto one = touched(1, 0.1);
  one[3].measured_mm.z() += 5;
  const auto off = check_field("today", one);
  EXPECT_EQ(off->worst_place, "divot 4");
  EXPECT_GT(off->worst_mm, 2);
}

TEST(FieldCheck, PlacesInAnotherUnitAreRefusedByName) {
  for (const auto& [scale, said] :
       std::vector<std::pair<double, const char*>>{{1e-3, "those that were measured seem to be in metres"},
                                                   {0.1, "those that were measured seem to be in cm"},
                                                   {1 / 25.4, "those that were measured seem to be in inches"},
                                                   {1000, "the plate's seem to be in metres"}}) {
    const auto check = check_field("today", touched(3, 0.2 * scale, scale));
    ASSERT_FALSE(check) << scale;
    EXPECT_NE(check.error().what.find(said), std::string::npos) << check.error().what;
  }
  EXPECT_TRUE(check_field("today", touched(3, 0.2, 1.5))) << "a bent field";
}

TEST(FieldCheck, TooFewPlacesOrOnALineAreRefused) {
  auto three = touched(1, 0);
  three.resize(3);
  EXPECT_EQ(check_field("", three).error().code, Errc::degenerate);
  auto line = touched(1, 0);
  for (std::size_t i = 0; i < line.size(); ++i) line[i].true_mm = {10.0 * static_cast<double>(i), 0, 0};
  EXPECT_FALSE(check_field("", line));
}

TEST(FieldCheck, LimitsAreThoseOfTheFirstDays) {
  EXPECT_FALSE(control_chart(days({0.5, 0.6, 0.4})));
  const auto chart = control_chart(days(after_usual({9, 9})));
  ASSERT_TRUE(chart);
  EXPECT_NEAR(chart->rms_mm.mean, 0.525, 1e-12);
  // Moving ranges .10 .15 .10 .10 .15 .10 .15: their mean over 1.128.
  EXPECT_NEAR(chart->rms_mm.sigma, 0.85 / 7 / 1.128, 1e-12);
  EXPECT_EQ(chart->scale_percent.sigma, 0.02);  // never moved: the least that is taken for it
}

TEST(FieldCheck, ADayThatFailedIsNotWhatIsUsual) {
  std::vector<double> history(9, 0.12);
  history[2] = 3.34;
  EXPECT_EQ(verdict_of(days(history)).grade, Grade::pass);
  history.push_back(1.19);  // ten times the usual, under the absolute limit
  EXPECT_EQ(verdict_of(days(history)).grade, Grade::fail);
}

TEST(FieldCheck, WhileLearningOnlyTheAbsoluteLimitCounts) {
  EXPECT_EQ(verdict_of(days({0.4})).grade, Grade::pass);
  EXPECT_EQ(verdict_of(days({0.4, 0.4, 1.4})).grade, Grade::pass);
  EXPECT_EQ(verdict_of(days({0.4, 2.0})).grade, Grade::marginal);
  EXPECT_EQ(verdict_of(days({0.4, 4.0})).grade, Grade::fail);
  EXPECT_EQ(verdict_of(days({NAN})).grade, Grade::fail);
  EXPECT_EQ(verdict_of({}).grade, Grade::fail);
}

TEST(FieldCheck, EachRuleFindsItsFault) {
  const auto grade = [](const std::vector<double>& more) { return verdict_of(days(after_usual(more))).grade; };
  const auto last = [](const std::vector<double>& more) { return verdict_of(days(after_usual(more))).reasons.back(); };
  EXPECT_EQ(grade({0.5, 0.6, 0.55}), Grade::pass);
  EXPECT_EQ(grade({0.9}), Grade::fail);
  EXPECT_NE(last({0.9}).find("3 sigma above"), std::string::npos);
  EXPECT_EQ(grade({0.76}), Grade::pass);
  EXPECT_EQ(grade({0.76, 0.5, 0.76}), Grade::marginal);
  EXPECT_NE(last({0.76, 0.5, 0.76}).find("two of the last three"), std::string::npos);
  EXPECT_EQ(grade({0.76, 0.5, 0.5, 0.76}), Grade::pass);
  EXPECT_EQ(grade({0.76, 0.76, 0.5}), Grade::pass);  // today is well again
  EXPECT_EQ(grade(std::vector<double>(8, 0.58)), Grade::marginal);
  EXPECT_NE(last(std::vector<double>(8, 0.58)).find("the last 8"), std::string::npos);
  EXPECT_EQ(grade({0.05}), Grade::pass);  // better than ever
}

TEST(FieldCheck, AScaleThatMovedIsFoundEitherWay) {
  for (const double moved : {-0.2, 0.4}) {
    auto history = days(after_usual({0.5}));
    history.back().scale_percent = moved;
    const Verdict verdict = verdict_of(history);
    EXPECT_EQ(verdict.grade, Grade::fail) << moved;
    EXPECT_NE(verdict.reasons.back().find("scale"), std::string::npos);
  }
}

// What the rules cost: of days that are all alike, how many are called out. Limits from eight days are themselves
// uncertain by a quarter, which is most of it.
TEST(FieldCheck, FewOrdinaryDaysAreCalledOut) {
  int alarms = 0, failed = 0, all = 0;
  for (unsigned trial = 0; trial < 60; ++trial) {
    std::vector<FieldCheck> history;
    for (unsigned day = 0; day < 30; ++day) {
      history.push_back(*check_field("", touched(1000 * trial + day, 0.3)));
      if (day < 8) continue;
      const Grade grade = verdict_of(history).grade;
      ++all;
      alarms += grade != Grade::pass ? 1 : 0;
      failed += grade == Grade::fail ? 1 : 0;
    }
  }
  EXPECT_LT(failed, all * 6 / 100);
  EXPECT_LT(alarms, all * 15 / 100);
}

TEST(FieldCheck, MetalThatCameIsFoundTheSameDay) {
  int found = 0;
  for (unsigned trial = 0; trial < 40; ++trial) {
    std::vector<FieldCheck> history;
    for (unsigned day = 0; day < 12; ++day) history.push_back(*check_field("", touched(1000 * trial + day, 0.3)));
    auto bent = touched(1000 * trial + 99, 0.3);
    for (CheckedPlace& place : bent)  // 4 mm at one end, none at the other
      place.measured_mm +=
          4 * std::pow(place.true_mm.y() / 110, 2) * Eigen::Vector3d(0.3, 0.9, 0.3) * (place.true_mm.x() > 70 ? 1 : 0);
    history.push_back(*check_field("", bent));
    found += verdict_of(history).grade == Grade::pass ? 0 : 1;
  }
  EXPECT_GE(found, 36);
}

}  // namespace
}  // namespace birdseye::calibration
