// How many levels of a board a map needs, and what is left out of it where it is not sure.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/field/field_fit.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {
namespace {

const Eigen::Vector3d kBoardMm(150, -200, -180), kMetalMm(650, 300, -380);
const Eigen::Matrix3d kAligned = Eigen::Matrix3d::Identity(), kTilted = rotation_exp({0.1, 0.2, 0.4});

/// As an iron ball bends the field: by a dipole's law.
Eigen::Vector3d bent(const Eigen::Vector3d& place_mm, double strength) {
  const Eigen::Vector3d from_metal = place_mm - kMetalMm;
  return place_mm + strength * from_metal / std::pow(from_metal.norm(), 3);
}

Eigen::Vector3d on_board(const Eigen::Matrix3d& turn, const Eigen::Vector3d& place_mm) {
  return turn * place_mm + kBoardMm;
}

/// Nine by nine places 60 mm apart at each level, each measured to 0.3 mm an axis.
std::vector<FieldSample> board(const std::vector<double>& levels_mm, const Eigen::Matrix3d& turn, double strength,
                               unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> noise(0, 0.3);
  std::vector<FieldSample> out;
  for (const double level_mm : levels_mm) {
    for (int i = 0; i < 81; ++i) {
      const int row = i / 9;
      const Eigen::Vector3d place(60.0 * (i % 9), 60.0 * row, level_mm);
      const Eigen::Vector3d measured =
          bent(on_board(turn, place), strength) + Eigen::Vector3d(noise(rng), noise(rng), noise(rng));
      out.push_back(
          {fmt::format("place {}", out.size() + 1), place, std::nullopt, {Eigen::Matrix3d::Identity(), measured}});
    }
  }
  return out;
}

std::string reasons_of(const FieldFit& fit) {
  std::string all;
  for (const std::string& reason : verdict_of(fit).reasons) all += reason + "\n";
  return all;
}

std::string refusal_of(const std::vector<FieldSample>& samples) {
  const auto fit = fit_field(samples);
  if (fit) return fmt::format("it was taken: {}", reasons_of(*fit));
  EXPECT_EQ(fit.error().code, Errc::degenerate);
  return fit.error().what;
}

TEST(FieldLevels, TwoLevelsAreRefusedHoweverTheBoardStands) {
  for (const Eigen::Matrix3d& turn : {kAligned, kTilted}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      auto samples = board({0, 110}, turn, 1e6, seed);
      EXPECT_NE(refusal_of(samples).find("measure at three levels or more"), std::string::npos) << refusal_of(samples);
      // One place written down at a wrong height is no third level.
      samples[40].true_mm.z() = 55;
      EXPECT_NE(refusal_of(samples).find("measure at three levels or more"), std::string::npos) << refusal_of(samples);
    }
    EXPECT_TRUE(fit_field(board({0, 60, 120}, turn, 1e6, 1)));
  }
}

TEST(FieldLevels, ATiltedBoardIsAsThinAsItIs) {
  for (const std::vector<double>& levels_mm : {std::vector<double>{0}, {0, 30}, {0, 30, 60}}) {
    const std::string why = refusal_of(board(levels_mm, kTilted, 1e6, 1));
    EXPECT_NE(why.find("mm along their own axes; a map needs 100 mm along each axis"), std::string::npos) << why;
  }
}

TEST(FieldLevels, WhereTheMapItselfIsNotSureNothingIsMapped) {
  constexpr double kStrength = 2e6;
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> across(20, 460), up(-50, 170);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const auto fit = fit_field(board({0, 60, 120}, kTilted, kStrength, seed));
    ASSERT_TRUE(fit) << fit.error().what;
    double within = 0, mapped_within = 0;
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d place(across(rng), across(rng), up(rng));
      const Eigen::Vector3d measured = bent(on_board(kTilted, place), kStrength);
      const auto corrected = fit->map.correct({Eigen::Matrix3d::Identity(), measured});
      const bool inside = place.z() >= 0 && place.z() <= 120;
      within += inside ? 1 : 0;
      mapped_within += inside && corrected ? 1 : 0;
      if (!corrected) continue;
      EXPECT_LE(corrected->sigma_mm, 2.5);
      const Eigen::Vector3d off = corrected->tracker_from_sensor.translation() - *fit->tracker_from_board * place;
      EXPECT_LE(off.norm(), 3 * corrected->sigma_mm) << place.transpose();
    }
    EXPECT_GT(mapped_within / within, 0.6);
  }
}

TEST(FieldLevels, TheMapsOwnSigmaIsInTheVerdict) {
  auto fit = fit_field(board({0, 60, 120, 180}, kAligned, 1e6, 1));
  ASSERT_TRUE(fit) << fit.error().what;
  ASSERT_TRUE(fit->sigma95_mm);
  EXPECT_GT(*fit->sigma95_mm, 0.3);
  EXPECT_LT(*fit->sigma95_mm, 1);
  EXPECT_NE(verdict_of(*fit).grade, Grade::fail) << reasons_of(*fit);
  EXPECT_NE(reasons_of(*fit).find("the map's own sigma"), std::string::npos) << reasons_of(*fit);
  const Grade before = verdict_of(*fit).grade;
  fit->sigma95_mm = 2.2;
  EXPECT_EQ(verdict_of(*fit).grade, std::max(before, Grade::marginal)) << reasons_of(*fit);
  EXPECT_NE(reasons_of(*fit).find("2.20 mm, more than 1.50"), std::string::npos) << reasons_of(*fit);
  fit->mapped_part = 0.05;
  EXPECT_EQ(verdict_of(*fit).grade, Grade::fail) << reasons_of(*fit);
}

}  // namespace
}  // namespace birdseye::calibration
