#include "host/calibrate/view_pairs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

namespace birdseye::host {
namespace {

using calibration::PatternView;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Names = std::vector<std::string>;

std::vector<PatternView> views(const Names& names) {
  std::vector<PatternView> out;
  for (const std::string& name : names) out.emplace_back().name = name;
  return out;
}

/// The right ones in the order of the left ones; what was wrong, alone, if they do not pair.
Names paired(const Names& left, const Names& right) {
  auto ordered = views(right);
  const auto done = pair_by_name(views(left), ordered);
  if (!done) return {done.error().what};
  Names out;
  for (const PatternView& view : ordered) out.push_back(view.name);
  return out;
}

TEST(ViewPairs, PartnersAreOfOneNumber) {
  EXPECT_THAT(paired({"left.9.png", "left.10.png"}, {"right.10.png", "right.9.png"}),
              ElementsAre("right.9.png", "right.10.png"));
  EXPECT_THAT(paired({"l-1.png", "l-20.png"}, {"r_0020.jpg", "r_0001.jpg"}), ElementsAre("r_0001.jpg", "r_0020.jpg"));
  EXPECT_THAT(paired({"v0.png", "v1.png"}, {"v01.png", "v00.png"}), ElementsAre("v00.png", "v01.png"));
}

TEST(ViewPairs, TheCamerasOwnNumbersDoNotCount) {
  EXPECT_THAT(paired({"cam0_3.png", "cam0_4.png"}, {"cam1_4.png", "cam1_3.png"}),
              ElementsAre("cam1_3.png", "cam1_4.png"));
  EXPECT_THAT(
      paired({"2026-11-22_left_1.png", "2026-11-22_left_2.png"}, {"2026-11-22_right_2.png", "2026-11-22_right_1.png"}),
      ElementsAre("2026-11-22_right_1.png", "2026-11-22_right_2.png"));
}

TEST(ViewPairs, WithoutNumbersThatTellThemApartTheWholeNameDoes) {
  EXPECT_THAT(paired({"a.png", "b.png"}, {"b.jpg", "a.jpg"}), ElementsAre("a.jpg", "b.jpg"));
  EXPECT_THAT(paired({"tilt1.png", "roll1.png"}, {"roll1.png", "tilt1.png"}), ElementsAre("tilt1.png", "roll1.png"));
}

TEST(ViewPairs, ManyInAnyOrder) {
  Names left, right;
  for (int i = 0; i < 200; ++i) {
    left.push_back("left" + std::to_string(7 * i) + ".png");
    right.push_back("right" + std::to_string(7 * i) + ".png");
  }
  const Names expected = right;
  std::mt19937 rng(1);
  std::shuffle(right.begin(), right.end(), rng);
  EXPECT_EQ(paired(left, right), expected);
}

TEST(ViewPairs, WhatHasNoPartnerIsNamed) {
  // As many of both: by their order they would pair, and wrongly.
  const Names wrong = paired({"left1.png", "left2.png", "left4.png"}, {"right2.png", "right4.png", "right5.png"});
  ASSERT_EQ(wrong.size(), 1U);
  EXPECT_THAT(wrong[0], HasSubstr("left1.png (left), right5.png (right)"));
  EXPECT_THAT(wrong[0], Not(HasSubstr("left2.png")));
  const Names fewer = paired({"1.png", "2.png"}, {"2.png"});
  EXPECT_THAT(fewer[0], HasSubstr("1.png (left)"));
  EXPECT_THAT(fewer[0], Not(HasSubstr("(right)")));
}

TEST(ViewPairs, NamesThatAreAlikeAreRefused) {
  EXPECT_THAT(paired({"left.png", "left.jpg"}, {"right.png", "right.jpg"})[0], HasSubstr("left.png and left.jpg"));
}

}  // namespace
}  // namespace birdseye::host
