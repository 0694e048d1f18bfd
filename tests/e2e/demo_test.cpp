#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/command.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::run;
using testing::Scratch;

nlohmann::json demo(const Scratch& scratch, const std::string& options, int code = 0) {
  const std::string out = (scratch / "demo").string();
  const auto result = run("birdseye", "demo --out " + out + " " + options);
  EXPECT_EQ(result.code, code) << result.output;
  std::ifstream in(scratch / "demo/report.json");
  nlohmann::json report = nlohmann::json::parse(in, nullptr, false);
  EXPECT_TRUE(report.is_object()) << result.output;
  for (const char* name : {"report.html", "overlay.png", "video.png", "overlay.mp4"}) {
    if (code != 0) break;  // nothing was drawn
    EXPECT_GT(std::filesystem::file_size(scratch / "demo" / name), 2000U) << name;
  }
  return report;
}

TEST(Demo, PutsTheTumourWhereItHasMovedDespiteTheTrackersNoise) {
  const Scratch scratch;
  // Of this seed the tumour moves by 7 mm with the liver.
  const nlohmann::json report = demo(scratch, "--seed 3");
  EXPECT_LE(report.value("target_error_mm_p95", 1e9), 4.0);
  EXPECT_GT(report.value("target_error_mm_p50", 0.0), 0.0);
  // The same frames with the CT as it was taken: the liver has moved by 10 mm since.
  EXPECT_GT(report.value("rigid_target_error_mm_p50", 0.0), 6.0);
  EXPECT_LE(report.value("target_error_mm_p50", 1e9), 0.4 * report.value("rigid_target_error_mm_p50", 0.0));
  EXPECT_GT(report.value("deformed_surface_expected_mm", 0.0), 0.1);
  EXPECT_GE(report.value("views_kept", 0), 4);
  EXPECT_LE(report.value("fre_mm", 1e9), 1.0);
  EXPECT_NEAR(report.value("tracker_rate_hz", 0.0), 103.3, 1.0);
  EXPECT_GT(report.value("frames", 0), 700);
  EXPECT_NE(report.value("verdict", "fail"), "fail");
  EXPECT_LT(report.value("frames_without_overlay", 1000), 10);
  EXPECT_GT(std::filesystem::file_size(scratch / "demo/rigid_and_deformed.png"), 2000U);
  std::ifstream lens(scratch / "demo/camera.yaml");
  const std::string text{std::istreambuf_iterator<char>(lens), {}};
  EXPECT_NE(text.find("camera_covariance"), std::string::npos) << "how well the lens is known was found, and is lost";
}

TEST(Demo, IsLimitedByTheRecordsStepsWithoutNoiseAndWithoutDeformation) {
  const Scratch scratch;
  const nlohmann::json report = demo(scratch, "--noise none --seed 2 --deformation-mm 0");
  EXPECT_LE(report.value("target_error_mm_p95", 1e9), 0.8);
  EXPECT_FALSE(report.contains("rigid_target_error_mm_p50"));
  EXPECT_FALSE(report.contains("views_kept"));
}

TEST(Demo, DrawsNothingOnceTheScopeIsTurnedInItsHolder) {
  const Scratch scratch;
  std::ofstream(scratch / "turned.toml") << "[[fault]]\nname = \"scope_turned\"\nat_s = 16\n";  // while it touches
  nlohmann::json report =
      demo(scratch, "--seed 2 --deformation-mm 0 --faults " + (scratch / "turned.toml").string(), 3);
  EXPECT_EQ(report.value("verdict", ""), "fail");
  EXPECT_TRUE(report["target_error_mm_p50"].is_null()) << "an overlay was drawn";
  EXPECT_NE(report.value("reasons", nlohmann::json()).dump().find("do not agree"), std::string::npos)
      << report.value("reasons", nlohmann::json());
}

}  // namespace
}  // namespace birdseye
