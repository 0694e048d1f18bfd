// What the demo's report says of the CT as it was taken and deformed.
#include "host/demo/demo_report.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/texts/texts.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;

std::string text_in(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<FrameError> errors(double least_mm) {
  std::vector<FrameError> out;
  for (int i = 0; i < 20; ++i) out.push_back({0.04 * i, least_mm + 0.1 * i, 10 * least_mm});
  return out;
}

DemoFigures deformed() {
  DemoFigures figures;
  figures.title = "a demo";
  figures.errors = errors(1);
  figures.deformation_mm = 9;
  figures.deforming = DeformingFigures{5, 7.25, "some places were found", true, 1.25, errors(7)};
  return figures;
}

TEST(DemoReport, PutsWhatTheCtShowedRigidBesideTheOverlaysOwnErrors) {
  const Scratch scratch;
  ASSERT_TRUE(write_demo_report(scratch.path(), deformed()));
  const nlohmann::json json = nlohmann::json::parse(text_in(scratch / "report.json"));
  EXPECT_NEAR(json["target_error_mm_p95"], 1 + 0.1 * 18, 1e-9);
  EXPECT_NEAR(json["rigid_target_error_mm_p95"], 7 + 0.1 * 18, 1e-9);
  EXPECT_NEAR(json["rigid_target_error_mm_max"], 7 + 0.1 * 19, 1e-9);
  EXPECT_EQ(json["rigid_overlay_error_px_p50"], 70);
  EXPECT_EQ(json["deformed_surface_expected_mm"], 1.25);
  EXPECT_EQ(json["views_kept"], 5);
  const std::string page = text_in(scratch / "report.html");
  for (const char* said : {"Before and after deforming", "up to 9 mm", "some places were found",
                           "7.90 / 8.80 / 8.90 mm", "1.90 / 2.80 / 2.90 mm", "rigid_and_deformed.png"})
    EXPECT_NE(page.find(said), std::string::npos) << said;
}

TEST(DemoReport, SaysWhatWasNotedOfTheCt) {
  const Scratch scratch;
  DemoFigures figures = deformed();
  ASSERT_TRUE(write_demo_report(scratch.path(), figures));
  EXPECT_FALSE(nlohmann::json::parse(text_in(scratch / "report.json")).contains("notes"));
  figures.notes = {"its orientation, PIL, was stated by a person (--orientation)"};
  ASSERT_TRUE(write_demo_report(scratch.path(), figures));
  EXPECT_EQ(nlohmann::json::parse(text_in(scratch / "report.json"))["notes"], figures.notes);
  EXPECT_NE(text_in(scratch / "report.html").find(figures.notes.front()), std::string::npos);
}

/// Frames before the first showing are counted by themselves, and would seem to be counted twice.
TEST(DemoReport, AVideoThatHasToShowItAnewIsNotTheOneThatHasNotShownItYet) {
  DemoFigures figures;
  figures.note_hidden(words("why_video_untold"));
  ASSERT_EQ(figures.hidden_because.size(), 1U);
  const std::string& why = figures.hidden_because.begin()->first;
  EXPECT_EQ(why.find("has not shown yet"), std::string::npos) << why;
  EXPECT_NE(why.find("had to show it anew"), std::string::npos) << why;
  figures.note_hidden("the pose is 123 ms old");
  EXPECT_TRUE(figures.hidden_because.contains("the pose is ... ms old"));
}

TEST(DemoReport, ShowsNoPairsWhereNothingWasFound) {
  const Scratch scratch;
  DemoFigures figures = deformed();
  figures.deforming->found = false;
  figures.deforming->surface_expected_mm.reset();
  figures.deforming->rigid_errors.clear();
  ASSERT_TRUE(write_demo_report(scratch.path(), figures));
  const nlohmann::json json = nlohmann::json::parse(text_in(scratch / "report.json"));
  EXPECT_EQ(json["views_kept"], 5);
  EXPECT_FALSE(json.contains("rigid_target_error_mm_p50"));
  EXPECT_FALSE(json.contains("deformed_surface_expected_mm"));
  const std::string page = text_in(scratch / "report.html");
  EXPECT_NE(page.find("some places were found"), std::string::npos);
  EXPECT_EQ(page.find("rigid_and_deformed.png"), std::string::npos);
}

TEST(DemoReport, SaysNothingOfDeformingWhereNothingHasMoved) {
  const Scratch scratch;
  DemoFigures figures = deformed();
  figures.deforming.reset();
  ASSERT_TRUE(write_demo_report(scratch.path(), figures));
  EXPECT_EQ(text_in(scratch / "report.html").find("deforming"), std::string::npos);
  EXPECT_FALSE(nlohmann::json::parse(text_in(scratch / "report.json")).contains("views_kept"));
}

}  // namespace
}  // namespace birdseye::host
