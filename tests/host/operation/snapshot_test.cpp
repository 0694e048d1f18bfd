#include "host/operation/snapshot.hpp"

#include <gtest/gtest.h>

#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect_and_calibrate;
using birdseye::testing::contents_of;
using birdseye::testing::kCamera;
using birdseye::testing::kTracker;
using birdseye::testing::Scratch;

wire::VideoFrame grey_frame() {
  wire::VideoFrame frame;
  frame.width_px = 8;
  frame.height_px = 6;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 8 * 6, 90);
  return frame;
}

Snapshot snapshot_with(PictureHardware taken_with) {
  Snapshot out;
  out.frame = grey_frame();
  out.picture = *out.frame.rgb;
  out.shown.width_px = 8;
  out.shown.height_px = 6;
  out.taken_with = std::move(taken_with);
  return out;
}

TEST(Snapshot, SaysWhatItsPictureWasTakenWith) {
  const Scratch scratch;
  ASSERT_TRUE(write_snapshot(scratch / "one", snapshot_with({kTracker, kCamera, "no. 17"})));
  for (const char* name : {"one/video.png", "one/picture.png"}) {
    const auto told = read_taken_with(scratch / name);
    ASSERT_TRUE(told) << told.error().what;
    EXPECT_EQ(told->tracker, kTracker);
    EXPECT_EQ(told->camera, kCamera);
    EXPECT_EQ(told->scope, "no. 17");
  }
}

TEST(Snapshot, SaysWhatItRestsOnThatNobodyKnownSigned) {
  const Scratch scratch;
  Snapshot unsigned_one = snapshot_with({});
  unsigned_one.not_signed = "recording";
  ASSERT_TRUE(write_snapshot(scratch / "one", unsigned_one));
  EXPECT_NE(contents_of(scratch / "one/snapshot.json").find("\"unsigned\": \"recording\""), std::string::npos);
}

TEST(Snapshot, LeavesOutWhatNobodyHasTold) {
  const Scratch scratch;
  ASSERT_TRUE(write_snapshot(scratch / "one", snapshot_with({})));
  for (const char* key : {"tracker", "camera", "scope", "unsigned"})
    EXPECT_EQ(contents_of(scratch / "one/snapshot.json").find('"' + std::string(key) + '"'), std::string::npos) << key;
  const auto told = read_taken_with(scratch / "one/video.png");
  ASSERT_TRUE(told);
  EXPECT_TRUE(told->tracker.empty() && told->camera.empty() && told->scope.empty());
}

TEST(Snapshot, OfAnotherPictureNothingIsKnownAndADamagedSheetIsRefused) {
  const Scratch scratch;
  ASSERT_TRUE(write_snapshot(scratch / "one", snapshot_with({kTracker, kCamera, ""})));
  const auto other = read_taken_with(scratch / "one/other.png");
  ASSERT_TRUE(other);
  EXPECT_TRUE(other->camera.empty());
  for (const char* wrong : {"", "[", "[1]", R"({"camera": 3})", R"({"scope": {}})"}) {
    (void)scratch.file("one/snapshot.json", wrong);
    const auto refused = read_taken_with(scratch / "one/video.png");
    ASSERT_FALSE(refused) << wrong;
    EXPECT_NE(refused.error().what.find("snapshot.json"), std::string::npos) << refused.error().what;
  }
}

TEST(Snapshot, TellsTheInstrumentsOfTheFrameThatIsShown) {
  LiveSettings settings;
  settings.authors = birdseye::testing::authors();
  LiveWorkflow workflow{settings};
  connect_and_calibrate(workflow);
  EXPECT_TRUE(workflow.taken_with().camera.empty()) << "no frame has come";
  workflow.take(grey_frame(), HostTime{1}, std::nullopt);
  EXPECT_EQ(workflow.taken_with().tracker, kTracker);
  EXPECT_EQ(workflow.taken_with().camera, kCamera);
  EXPECT_EQ(workflow.taken_with().scope, birdseye::testing::straight_scope_record().scope);
  // A frozen picture stays that of the camera that took it.
  workflow.freeze_or_let_go();
  const calibration::Identity other{{"card", "Storz"}, {"serial", "B2"}};
  birdseye::testing::tell_health(workflow, kTracker, other);
  workflow.take(grey_frame(), HostTime{2}, std::nullopt);
  EXPECT_EQ(workflow.taken_with().camera, kCamera);
  workflow.freeze_or_let_go();
  workflow.take(grey_frame(), HostTime{3}, std::nullopt);
  EXPECT_EQ(workflow.taken_with().camera, other);
}

}  // namespace
}  // namespace birdseye::host
