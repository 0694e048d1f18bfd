#include <fmt/format.h>
#include <gtest/gtest.h>

#include "calibration/field/field_pairs.hpp"
#include "calibration/field/field_regression.hpp"
#include "tests/support/simulated_field.hpp"

namespace birdseye::calibration {
namespace {

using testing::against_truth;

/// A bar with two sensors that is carried through the volume and turned.
std::vector<FieldPair> bar_pairs(const hw_sim::FieldDistortion& field, int count, double length_mm, double noise_mm,
                                 double noise_deg, unsigned seed, double turn_rad = 1.2) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> part(0, 1);
  const Transform<Sensor, Sensor> a_from_b(rotation_exp({0.3, 0.1, -0.2}), Eigen::Vector3d(length_mm, 0, 0));
  std::vector<FieldPair> out;
  while (out.size() < static_cast<std::size_t>(count)) {
    const Eigen::Vector3d place =
        testing::kVolumeLowMm +
        Eigen::Vector3d(part(rng), part(rng), part(rng)).cwiseProduct(testing::kVolumeHighMm - testing::kVolumeLowMm);
    const Eigen::Vector3d turn = turn_rad * Eigen::Vector3d(2 * part(rng) - 1, 2 * part(rng) - 1, 2 * part(rng) - 1);
    const Transform<Tracker, Sensor> a(rotation_exp(turn), place);
    const Transform<Tracker, Sensor> b = a * a_from_b;
    const Eigen::Vector3d& end = b.translation();
    if ((end - testing::kVolumeLowMm).minCoeff() < 0 || (testing::kVolumeHighMm - end).minCoeff() < 0) continue;
    out.push_back({"pair " + std::to_string(out.size() + 1), testing::measured(field, a, noise_mm, noise_deg, rng),
                   testing::measured(field, b, noise_mm, noise_deg, rng)});
  }
  return out;
}

TEST(FieldPairs, ABarThatIsRigidShowsWhereTheFieldIsBent) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const hw_sim::FieldDistortion field(10, seed);
    const double noise_mm = seed == 1 ? 0.3 : 1.0;
    FieldPairSettings settings;
    settings.distance_mm = 150;
    if (seed == 2) settings.basis = FieldBasis::polynomial;
    const auto fit =
        fit_field_from_pairs(bar_pairs(field, seed == 1 ? 400 : 700, 150, noise_mm, 0.3 * noise_mm, seed), settings);
    ASSERT_TRUE(fit) << fit.error().what;
    const auto truth = against_truth(fit->map, field, seed + 50);
    EXPECT_GT(truth.before_mm, 2);
    EXPECT_LT(truth.after_mm, 0.8) << seed;
    EXPECT_LT(truth.after_deg, truth.before_deg / 2) << seed;
    EXPECT_GT(truth.mapped, 0.95);
    EXPECT_LT(fit->held_out_mm, 0.75 * fit->before_mm);
    EXPECT_NEAR(fit->a_from_b_mm->norm(), 150, 0.5);
    EXPECT_NE(verdict_of(*fit).grade, Grade::fail);
  }
}

TEST(FieldPairs, WhatABarDoesNotTellIsNotClaimed) {
  const hw_sim::FieldDistortion field(10, 3);
  FieldPairSettings settings;
  settings.basis = FieldBasis::polynomial;
  const auto unknown_length = fit_field_from_pairs(bar_pairs(field, 300, 150, 0.3, 0.1, 5), settings);
  ASSERT_TRUE(unknown_length);
  const Verdict doubtful = verdict_of(*unknown_length);
  EXPECT_EQ(doubtful.grade, Grade::marginal);
  EXPECT_NE(doubtful.reasons.back().find("distance between the sensors is not given"), std::string::npos);

  settings.distance_mm = 150;
  const auto never_turned = fit_field_from_pairs(bar_pairs(field, 300, 150, 0.3, 0.1, 6, 0.05), settings);
  ASSERT_TRUE(never_turned);
  EXPECT_EQ(verdict_of(*never_turned).grade, Grade::fail);
  EXPECT_NE(verdict_of(*never_turned).reasons.back().find("hardly turned"), std::string::npos);
}

TEST(FieldPairs, PairsThatSlippedAreNamed) {
  const hw_sim::FieldDistortion field(10, 4);
  auto pairs = bar_pairs(field, 400, 150, 0.3, 0.1, 7);
  for (const std::size_t slipped : {20U, 200U, 333U})
    pairs[slipped].b = Transform<Tracker, Sensor>(
        pairs[slipped].b.rotation(), Eigen::Vector3d(pairs[slipped].b.translation() + Eigen::Vector3d(0, 30, 0)));
  FieldPairSettings settings;
  settings.basis = FieldBasis::polynomial;
  settings.distance_mm = 150;
  const auto fit = fit_field_from_pairs(pairs, settings);
  ASSERT_TRUE(fit);
  std::vector<std::string> named;
  for (const FieldResidual& r : fit->residuals) {
    if (r.outlier) named.push_back(r.name);
  }
  EXPECT_EQ(named, (std::vector<std::string>{"pair 21", "pair 201", "pair 334"}));
  EXPECT_LT(against_truth(fit->map, field, 9).after_mm, 0.8);
}

TEST(FieldPairs, TwoSensorsThatAreNotOnOneBodyAreRefused) {
  const hw_sim::FieldDistortion field(10, 4);
  const auto one = bar_pairs(field, 300, 150, 0.3, 0.1, 7), other = bar_pairs(field, 300, 150, 0.3, 0.1, 8);
  auto apart = one;
  for (std::size_t i = 0; i < apart.size(); ++i) apart[i].b = other[i].b;
  FieldPairSettings settings;
  for (const double distance_mm : {0.0, 310.0}) {
    if (distance_mm > 0) settings.distance_mm = distance_mm;
    const auto fit = fit_field_from_pairs(apart, settings);
    ASSERT_FALSE(fit);
    EXPECT_EQ(fit.error().code, Errc::degenerate);
    EXPECT_NE(fit.error().what.find("these two do not sit on one rigid body"), std::string::npos) << fit.error().what;
  }
  // A body that slipped halfway is two bodies.
  auto slipped = one;
  for (std::size_t i = 0; i < slipped.size(); ++i) {
    if (i % 2 == 0) slipped[i].b = slipped[i].b * Transform<Sensor, Sensor>(Eigen::Matrix3d::Identity(), {-70, 60, 40});
  }
  const auto fit = fit_field_from_pairs(slipped, settings);
  if (fit) {
    EXPECT_EQ(verdict_of(*fit).grade, Grade::fail);
  }
}

TEST(FieldPairs, AFoldWithoutPairsAddsNothing) {
  detail::FoldedNormals normals(300, 1);
  normals.add(3, Eigen::MatrixXd(0, 300), Eigen::MatrixXd(0, 1));
  EXPECT_EQ(normals.gram[3].norm(), 0);
}

TEST(FieldPairs, ADistanceThatIsNotTheBodysFailsWithBothFigures) {
  const hw_sim::FieldDistortion field(10, 4);
  const auto pairs = bar_pairs(field, 300, 150, 0.3, 0.1, 7);
  struct Case {
    double distance_mm;
    Grade grade;
    const char* step;
  };
  for (const Case& c :
       {Case{15, Grade::fail, "15 seems to be in cm"}, Case{5.9, Grade::fail, "5.9 seems to be in inches"},
        Case{165, Grade::fail, "measure the distance"}, Case{155, Grade::marginal, "measure the distance"},
        Case{150, Grade::pass, ""}}) {
    FieldPairSettings settings;
    settings.basis = FieldBasis::polynomial;
    settings.distance_mm = c.distance_mm;
    const auto fit = fit_field_from_pairs(pairs, settings);
    ASSERT_TRUE(fit) << fit.error().what;
    const Verdict verdict = verdict_of(*fit);
    EXPECT_EQ(verdict.grade, c.grade) << c.distance_mm;
    if (c.grade == Grade::pass) continue;
    EXPECT_NE(verdict.reasons.back().find(fmt::format("{:.1f} mm by --distance", c.distance_mm)), std::string::npos);
    EXPECT_NE(verdict.reasons.back().find("mm apart by the tracker"), std::string::npos) << verdict.reasons.back();
    EXPECT_NE(verdict.next_steps.back().find(c.step), std::string::npos) << verdict.next_steps.back();
  }
}

TEST(FieldPairs, InputThatCannotBeUsedIsNamed) {
  const hw_sim::FieldDistortion field(10, 4);
  EXPECT_EQ(fit_field_from_pairs(bar_pairs(field, 50, 150, 0, 0, 1)).error().code, Errc::degenerate);
  const auto close = fit_field_from_pairs(bar_pairs(field, 200, 10, 0, 0, 1));
  ASSERT_FALSE(close);
  EXPECT_NE(close.error().what.find("mm apart"), std::string::npos) << close.error().what;
  auto pairs = bar_pairs(field, 200, 150, 0, 0, 1);
  pairs[7].a = Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), Eigen::Vector3d(NAN, 0, 0));
  EXPECT_NE(fit_field_from_pairs(pairs).error().what.find("pair 8"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::calibration
