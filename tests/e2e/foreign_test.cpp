// `birdseye record` and `birdseye live` at a server of tracked video that is no appliance of ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

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
  EXPECT_GT(json["poses"]["scope"].get<int>(), 10);
  EXPECT_GT(json["poses"]["StylusToTracker"].get<int>(), 10);
  int posed = 0;
  std::ifstream events(scratch / "r" / "events.jsonl");
  for (std::string line; std::getline(events, line);)
    posed += line.find("\"kind\":\"exact\"") != std::string::npos ? 1 : 0;
  EXPECT_GT(posed, 10) << "frames with the pose of their own stamp";
}

TEST(ForeignCommands, LiveGoesOnOnlyOnceTheScopeIsNamed) {
  ForeignServer server(true);
  const Scratch scratch;
  const testing::Display display("1280x720");
  const std::string script = scratch.file("script.txt", "wait connect 15\nsleep 1\nend\n");
  const std::string common = "live --server 127.0.0.1:" + std::to_string(server.port()) + " --ct " +
                             testing::small_ct(scratch) + " --script " + script + " --json " +
                             (scratch / "live.json").string();
  const auto unnamed = run("birdseye", common, display.env());
  EXPECT_NE(unnamed.code, 0);
  EXPECT_THAT(unnamed.output, HasSubstr("several devices send poses, \"ProbeToTracker\", \"StylusToTracker\": say by "
                                        "--scope-device which are the scope's"));
  const auto named = run("birdseye", common + " --scope-device ProbeToTracker", display.env());
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
