// `birdseye record` and `birdseye live` at a server of tracked video that is no appliance of ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/files/pose_files.hpp"
#include "host/files/sequence_header.hpp"
#include "tests/support/command.hpp"
#include "tests/support/display.hpp"
#include "tests/support/foreign_server.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/plus_server.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

using testing::ForeignServer;
using ::testing::HasSubstr;
using testing::read_json;
using testing::run;
using testing::Scratch;

TEST(ForeignCommands, RecordKeepsItsVideoAndPoses) {
  ForeignServer server(true);
  const Scratch scratch;
  const auto result = run("birdseye", "record --seconds 2 --scope-device ProbeToTracker --server 127.0.0.1:" +
                                          std::to_string(server.port()) + " --out " + (scratch / "r").string() +
                                          " --json " + (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("no appliance of Birdseye; passed over: STRING"));
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_EQ(json["verdict"], "pass") << json;
  EXPECT_GT(json["frames"].get<int>(), 0);
  EXPECT_GT(json["poses"]["ProbeToTracker"].get<int>(), 10);
  EXPECT_GT(json["poses"]["StylusToTracker"].get<int>(), 10);
  int posed = 0;
  std::ifstream events(scratch / "r" / "events.jsonl");
  for (std::string line; std::getline(events, line);)
    posed += line.find("\"kind\":\"exact\"") != std::string::npos ? 1 : 0;
  EXPECT_GT(posed, 10) << "frames with the pose of their own stamp";
}

TEST(ForeignCommands, WhatWasRecordedIsFoundByTheNamesThatTheServerGave) {
  testing::PlusServer server;
  const Scratch scratch;
  const std::string folder = (scratch / "r").string();
  const auto recorded = run("birdseye",
                            "record --seconds 2 --scope-device ProbeToTracker --video-device Image_Reference"
                            " --server 127.0.0.1:" +
                                std::to_string(server.port()) + " --out " + folder);
  ASSERT_EQ(recorded.code, 0) << recorded.output;
  // Each transform came as a message of its own; those of one stamp are one frame.
  for (const char* file : {"/tracker.igs.mha", "/video.igs.mha"}) {
    const auto header = host::read_sequence_header(folder + file);
    ASSERT_TRUE(header) << header.error().what;
    for (const std::string& name : header->transforms)
      EXPECT_TRUE(name.find("ToTrackerToTracker") == std::string::npos);
    EXPECT_TRUE(header->transforms.contains("ProbeToTracker")) << file;
    EXPECT_FALSE(header->transforms.contains("ScopeToTracker")) << file;
  }
  const auto against = host::read_pose_set(folder, {"ProbeToTracker", "StylusToTracker"});
  ASSERT_TRUE(against) << against.error().what;
  EXPECT_GT(against->poses.size(), 10U);
  EXPECT_LT(against->rejected.size(), against->poses.size());
  // The calibrations find it, though this motion is none.
  const auto tip = run("birdseye", "calibrate tip --recording " + folder + " --tool ProbeToTracker");
  EXPECT_THAT(tip.output, HasSubstr("verdict:"));
  const auto unnamed = run("birdseye", "calibrate tip --recording " + folder);
  EXPECT_EQ(unnamed.code, 2) << unnamed.output;
  EXPECT_THAT(unnamed.output, HasSubstr("ProbeToTracker"));
  const auto latency = run("birdseye", "calibrate latency --recording " + folder + " --bird NoneToTracker");
  EXPECT_EQ(latency.code, 2) << latency.output;
  EXPECT_THAT(latency.output, HasSubstr("ProbeToTracker"));
  const auto hand_eye =
      run("birdseye", "calibrate hand-eye --board chessboard:9x6:5mm --bird NoneToTracker --recording " + folder);
  EXPECT_EQ(hand_eye.code, 2) << hand_eye.output;
  EXPECT_THAT(hand_eye.output, HasSubstr("ProbeToTracker"));
}

TEST(ForeignCommands, LiveGoesOnOnlyOnceTheScopeIsNamed) {
  ForeignServer server(true);
  const Scratch scratch;
  const testing::Display display("1280x720");
  const std::string brief = scratch.file("brief.txt", "wait connect 3\nend\n");
  const std::string script = scratch.file("script.txt", "wait connect 15\nsleep 1\nend\n");
  const std::string common = "live --server 127.0.0.1:" + std::to_string(server.port()) + " --ct " +
                             testing::small_ct(scratch) + " --json " + (scratch / "live.json").string() + " --script ";
  const auto unnamed = run("birdseye", common + brief, display.env());
  EXPECT_NE(unnamed.code, 0);
  EXPECT_THAT(unnamed.output, HasSubstr("several devices send poses, \"ProbeToTracker\", \"StylusToTracker\": say by "
                                        "--scope-device which are the scope's"));
  const auto named = run("birdseye", common + script + " --scope-device ProbeToTracker", display.env());
  ASSERT_EQ(named.code, 0) << named.output;
  const nlohmann::json json = read_json(scratch / "live.json");
  EXPECT_GT(json["frames"].get<int>(), 10);
}

TEST(ForeignCommands, LiveRunsAtAServerThatBehavesAsPlus) {
  testing::PlusServer server;
  const Scratch scratch;
  const testing::Display display("1280x720");
  const std::string script = scratch.file("script.txt", "wait connect 15\nsleep 1\nend\n");
  const auto result =
      run("birdseye",
          "live --server 127.0.0.1:" + std::to_string(server.port()) + " --ct " + testing::small_ct(scratch) +
              " --scope-device ProbeToTracker --video-device Image_Reference --pointer StylusToTracker"
              " --script " +
              script + " --json " + (scratch / "live.json").string(),
          display.env());
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_GT(read_json(scratch / "live.json")["frames"].get<int>(), 10);
}

}  // namespace
}  // namespace birdseye
