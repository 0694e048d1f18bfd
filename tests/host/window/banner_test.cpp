// What is said over the picture and below it, and in which colour.
#include "host/window/banner.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace birdseye::host {
namespace {

/// Matched, watched, and a landmark was checked.
OperationView all_is_well() {
  OperationView out;
  out.deformed = std::make_shared<const DeformedOrgan>();
  out.watched = out.surface_told = true;
  out.checked = CheckedLandmark{"tumour", 1};
  out.reference = "reference";
  return out;
}

Banner over_a_whole_overlay(const OperationView& operation) {
  ShownPicture shown;
  shown.any = shown.overlaid = true;
  shown.strength = 1;
  return banner_of(operation, shown, {});
}

TEST(Banner, IsGreenWhereACheckOfTheSurfaceCouldTellLatelyAndNotElse) {
  OperationView operation = all_is_well();
  EXPECT_EQ(over_a_whole_overlay(operation).grade, Grade::pass) << over_a_whole_overlay(operation).text;
  operation.surface_told = false;
  Banner banner = over_a_whole_overlay(operation);
  EXPECT_EQ(banner.grade, Grade::marginal);
  EXPECT_NE(banner.text.find("whether the organ has moved cannot be told now"), std::string::npos) << banner.text;
  operation.surface_unchecked = true;
  banner = over_a_whole_overlay(operation);
  EXPECT_EQ(banner.grade, Grade::marginal);
  EXPECT_NE(banner.text.find("no check since the CT was matched could tell yet"), std::string::npos) << banner.text;
  operation.watched = operation.surface_unchecked = false;
  banner = over_a_whole_overlay(operation);
  EXPECT_EQ(banner.grade, Grade::marginal);
  EXPECT_NE(banner.text.find("nothing watches whether the organ moves"), std::string::npos) << banner.text;
}

TEST(Banner, TheLineBelowSaysWhetherTheOrganIsWatchedAndWhetherThatTellsAnything) {
  OperationView operation = all_is_well();
  EXPECT_TRUE(watch_line_of(operation).good);
  EXPECT_TRUE(watch_line_of(operation).text.ends_with("the organ is watched")) << watch_line_of(operation).text;
  operation.organ_moved = true;
  EXPECT_FALSE(watch_line_of(operation).good);
  EXPECT_NE(watch_line_of(operation).text.find("and has moved"), std::string::npos);
  operation.organ_moved = operation.surface_told = false;
  EXPECT_FALSE(watch_line_of(operation).good);
  EXPECT_NE(watch_line_of(operation).text.find("cannot be told now"), std::string::npos);
  operation.surface_unchecked = true;
  EXPECT_FALSE(watch_line_of(operation).good);
  EXPECT_NE(watch_line_of(operation).text.find("could tell yet"), std::string::npos);
  operation = all_is_well();
  operation.watched = operation.surface_told = false;
  EXPECT_FALSE(watch_line_of(operation).good);
  EXPECT_NE(watch_line_of(operation).text.find("the organ is not watched"), std::string::npos);
  operation = all_is_well();
  operation.reference.clear();
  EXPECT_FALSE(watch_line_of(operation).good) << "nothing sees that patient or transmitter moves";
}

}  // namespace
}  // namespace birdseye::host
