// `birdseye doctor` on the machine that the tests run on, and beside an appliance without instruments.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "drivers/system/local_programs.hpp"
#include "tests/support/child.hpp"
#include "tests/support/command.hpp"
#include "tests/support/display.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using ::testing::HasSubstr;
using testing::read_json;
using testing::run;
using testing::Scratch;

constexpr const char* kNoDisplay = "env -u DISPLAY -u WAYLAND_DISPLAY";

std::string state_of(const nlohmann::json& json, const std::string& area, const std::string& name) {
  for (const auto& check : json["checks"]) {
    if (check["area"] == area && check["name"] == name) return check["state"];
  }
  return "nothing is said of " + name;
}

TEST(Doctor, AsksEveryAreaOfThisMachine) {
  const Scratch scratch;
  const std::string file = (scratch / "d.json").string();
  const auto result = run("birdseye", "doctor --out " + scratch.path().string() + " --json " + file, kNoDisplay);
  const nlohmann::json json = read_json(file);
  EXPECT_EQ(result.code, json["counts"]["bad"] == 0 ? 0 : 3) << result.output;
  std::set<std::string> areas;
  for (const auto& check : json["checks"]) {
    areas.insert(check["area"]);
    EXPECT_FALSE(check["found"].get<std::string>().empty()) << check;
    EXPECT_TRUE(check["state"] != "bad" || check.contains("do")) << check;
  }
  for (const char* area : {"tracker lines", "cameras", "pins", "appliance on this machine", "this computer", "display"})
    EXPECT_EQ(areas.count(area), 1U) << area;
  EXPECT_EQ(state_of(json, "this computer", "decoder of CTs"), "good");
  EXPECT_EQ(state_of(json, "display", "window"), "missing");
}

TEST(Doctor, WhatIsNamedAndDoesNotWorkIsBad) {
  const Scratch scratch;
  const std::string config = scratch.file("c.toml", "[tracker]\nbirds = \"two\"\n[zoo]\n");
  const std::string record = scratch.file("record.json", "{}");
  const std::string ct = scratch.file("ct.nii.gz", "");
  const auto result =
      run("birdseye", fmt::format("doctor --config {} --record {} --ct {}", config, record, ct), kNoDisplay);
  EXPECT_EQ(result.code, 3) << result.output;
  for (const char* words :
       {"c.toml:2: [tracker] birds", "zoo: unknown section", "record.json: is no calibration record", "ct.nii.gz: "}) {
    EXPECT_THAT(result.output, HasSubstr(words));
  }
}

TEST(Doctor, LooksAtTheDisplay) {
  const Scratch scratch;
  const std::string file = (scratch / "d.json").string();
  const testing::Display display("1024x768");
  (void)run("birdseye", "doctor --json " + file, display.env());
  EXPECT_EQ(state_of(read_json(file), "display", "window"), "good");
  EXPECT_EQ(state_of(read_json(file), "display", "screen"), "could be better");
  const auto old = run("birdseye", "doctor --json " + file, display.env() + " MESA_GL_VERSION_OVERRIDE=3.3");
  EXPECT_EQ(old.code, 3) << old.output;
  EXPECT_THAT(old.output, HasSubstr("OpenGL 4.5"));
  const auto gone = run("birdseye", "doctor --json " + file, "env -u WAYLAND_DISPLAY DISPLAY=:4999");
  EXPECT_EQ(gone.code, 3) << gone.output;
}

TEST(Doctor, SaysWhatAnApplianceSaysOfItself) {
  const Scratch scratch;
  const int port = *free_port();
  const std::string config = scratch.file(
      "c.toml", fmt::format("[tracker]\ndevice = \"unix:{0}/tracker\"\n[camera]\nsource = \"socket:{0}/camera\"\n"
                            "[wire]\nport = {1}\n",
                            scratch.path().string(), port));
  testing::Child birdseyed({testing::programs_folder() + "/birdseyed", "--config", config});
  ASSERT_TRUE(birdseyed.says({"publishing on"}, Deadline::after(Duration::from_ms(20'000)))) << birdseyed.output();
  const std::string file = (scratch / "d.json").string();
  const auto result = run("birdseye", fmt::format("doctor --server 127.0.0.1:{} --json {}", port, file), kNoDisplay);
  EXPECT_EQ(result.code, 3) << result.output;
  const nlohmann::json json = read_json(file);
  EXPECT_EQ(state_of(json, "appliance", "connection"), "good");
  EXPECT_EQ(state_of(json, "appliance", "tracker"), "bad") << result.output;
  EXPECT_EQ(state_of(json, "appliance", "camera"), "bad") << result.output;
  EXPECT_EQ(state_of(json, "appliance", "calibration record"), "missing") << result.output;
  EXPECT_EQ(state_of(json, "appliance on this machine", "birdseyed"), "good") << result.output;
}

TEST(Doctor, AServerThatIsNotThereIsBad) {
  const auto result = run("birdseye", "doctor --server 127.0.0.1:1", kNoDisplay);
  EXPECT_EQ(result.code, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("127.0.0.1:1: nothing answers"));
}

}  // namespace
}  // namespace birdseye
