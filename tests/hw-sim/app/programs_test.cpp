// birdseye-sim minibird and camera from the outside.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::contents_of;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;

std::string example() {
  const char* source = std::getenv("BIRDSEYE_SOURCE_DIR");
  return std::string(source != nullptr ? source : ".") + "/docs/manual/examples/track.py";
}

/// Runs the manual's Python program against a simulator that the shell starts for it; device is what it opens, $out
/// the file of what the simulator says.
testing::CommandResult track(const Scratch& scratch, const std::string& options, const std::string& device) {
  const std::string out = (scratch / "out").string();
  return run("birdseye-sim", "minibird " + options + " --seconds 60 > " + out + " & sim=$!; out=" + out +
                                 "; while ! grep -qs ready $out; do sleep 0.02; done; timeout 30 python3 " + example() +
                                 " " + device + " 50; kill $sim; wait $sim");
}

void expect_circle(const testing::CommandResult& result) {
  EXPECT_EQ(result.code, 0) << result.output;
  std::istringstream lines(result.output);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(line, "6DFOB");
  int count = 0;
  while (std::getline(lines, line)) {
    double x = 0, y = 0, z = 0, azimuth = 0, elevation = 0, roll = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf mm %lf %lf %lf", &x, &y, &z, &azimuth, &elevation, &roll), 6)
        << line;
    EXPECT_NEAR(std::hypot(x - 400, y), 200, 0.4) << line;
    const double around = std::atan2(y, x - 400) * 180 / M_PI;
    EXPECT_NEAR(std::remainder(azimuth - around, 360), 0, 0.2) << line;
    ++count;
  }
  EXPECT_EQ(count, 50);
}

TEST(Programs, TheManualsPythonProgramTracksAtATerminal) {
  const Scratch scratch;
  const std::string tty = (scratch / "tty").string();
  expect_circle(track(scratch, "--tty " + tty + " --boot-ms 0", tty));
}

TEST(Programs, TheManualsPythonProgramTracksOverTcp) {
  const Scratch scratch;
  expect_circle(track(scratch, "--tcp 0 --boot-ms 0", "tcp:$(sed -n 's/.*\"tracker\":\"\\([^\"]*\\)\".*/\\1/p' $out)"));
}

TEST(Programs, TruthIsWrittenBeforeReadyIsSaid) {
  const Scratch scratch;
  const std::string truth = (scratch / "truth.json").string();
  const auto result = run("birdseye-sim", "minibird --unix " + (scratch / "line").string() +
                                              " --drift-ppm 100 --truth " + truth + " --seconds 0.05");
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_EQ(nlohmann::json::parse(result.output)["event"], "ready");
  const auto json = read_json(truth);
  EXPECT_NEAR(json["rate_hz"].get<double>(), 103.3 * 1.0001, 1e-9);
  EXPECT_EQ(json["radius_mm"], 200);
  EXPECT_EQ(json["period_s"], 2);
  EXPECT_EQ(json["centre_mm"], nlohmann::json({400, 0, 0}));
  EXPECT_GT(json["zero_monotonic_ns"].get<std::int64_t>(), 0);
}

TEST(Programs, TruthIsWrittenToAPipeAsItIsAndOverNothingElse) {
  const Scratch scratch;
  const std::string bird = "minibird --unix " + (scratch / "line").string() + " --seconds 0.05 --truth ";
  const std::string pipe = (scratch / "pipe").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  expect_refused("birdseye-sim", bird + pipe, {pipe + ": nobody reads this pipe"});
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  // The camera's is written once.
  const auto piped = run("birdseye-sim", "camera --socket " + (scratch / "frames").string() +
                                             " --size 128x96 --seconds 0.05 --truth " + pipe);
  EXPECT_EQ(piped.code, 0) << piped.output;
  std::array<char, 4096> text{};
  const ssize_t got = ::read(reader, text.data(), text.size());
  ::close(reader);
  ASSERT_GT(got, 0);
  EXPECT_EQ(nlohmann::json::parse(text.begin(), text.begin() + got)["width_px"], 128);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));

  const std::string truth = (scratch / "truth.json").string(), other = scratch.file("truth.json.new", "a user's");
  ASSERT_EQ(run("birdseye-sim", bird + truth).code, 0);
  EXPECT_EQ(read_json(truth)["radius_mm"], 200);
  EXPECT_EQ(contents_of(other), "a user's");
  const std::filesystem::path folder = scratch / "folder";
  std::filesystem::create_directory(folder);
  expect_refused("birdseye-sim", bird + folder.string(), {folder.string() + ": is a folder"}, folder.string() + ".new");
}

TEST(Programs, NoOutputIsAnInput) {
  const Scratch scratch;
  const std::string text = "[[fault]]\nname = \"saturated\"\nat_s = 1\nfor_s = 1\n";
  const std::string faults = scratch.file("ok.toml", text), link = (scratch / "link.toml").string();
  std::filesystem::create_symlink("ok.toml", link);
  const std::string bird = "minibird --tcp 0 --seconds 0.05 --faults " + faults;
  const std::string camera = "camera --seconds 0.05 --socket " + (scratch / "frames").string() + " --faults " + faults;
  const std::string operation = "operation --script " + faults;
  for (const std::string& name : {faults, link}) {
    for (const std::string& arguments : {bird + " --truth ", camera + " --truth ", camera + " --strobe ",
                                         operation + " --log ", operation + " --faults "})
      expect_refused("birdseye-sim", arguments + name, {name + ": is read by this command"});
  }
  EXPECT_EQ(contents_of(faults), text);
  EXPECT_TRUE(std::filesystem::is_symlink(link));

  std::filesystem::create_directories(scratch / "ph/ct");
  const std::string ct = (scratch / "ph/ct").string(), slice = scratch.file("ph/ct/0001.dcm", "a patient's");
  for (const std::string& input : {ct, slice})
    expect_refused("birdseye-sim", "phantom --out " + (scratch / "ph").string() + " --ct " + input,
                   {ct + ": is read by this command"}, scratch / "ph/truth.json");
  EXPECT_EQ(contents_of(slice), "a patient's");
}

TEST(Programs, AnOperationIsNotRunForFilesThatCannotBeWritten) {
  const Scratch scratch;
  const std::string log = (scratch / "log").string(), nowhere = (scratch / "none/log").string();
  for (const std::string option : {"--log ", "--faults "}) {
    expect_refused("birdseye-sim", "operation --minutes 0.5 " + option + nowhere, {nowhere + ": cannot be written"});
    expect_refused("birdseye-sim", "operation --minutes 0.5 " + option + scratch.path().string(),
                   {scratch.path().string() + ": is a folder"});
  }
  expect_refused("birdseye-sim",
                 "operation --minutes 0.5 --log " + log + " --faults " + scratch.path().string() + "/./log",
                 {log + ": is named by --log and by --faults"}, log);
}

/// As on a disk that is full.
TEST(Programs, WhatCameOfAnOperationIsToldBeforeItsFilesAreWritten) {
  const auto told = run("birdseye-sim", "operation --minutes 0.5 --log /dev/full");
  EXPECT_EQ(told.code, 2) << told.output;
  EXPECT_NE(told.output.find("seed 1: 0.5 minutes"), std::string::npos) << told.output;
  EXPECT_NE(told.output.find("/dev/full: cannot be written"), std::string::npos) << told.output;
}

TEST(Programs, WhatIsTheUsersOwnIsNotWrittenOver) {
  for (const std::string command : {"phantom", "case"}) {
    const Scratch scratch;
    const std::string own = scratch.file("segmentation.nii.gz", "a user's");
    expect_refused("birdseye-sim", command + " --out " + scratch.path().string(),
                   {own + ": is there", "no earlier birdseye-sim " + command, "choose another --out"},
                   scratch / ("birdseye-sim-" + command + ".json"));
    EXPECT_EQ(contents_of(own), "a user's");
  }
}

TEST(Programs, ACameraSaysWhereItIsAndWhatItSent) {
  const Scratch scratch;
  const std::string truth = (scratch / "truth.json").string();
  const auto result = run("birdseye-sim", "camera --socket " + (scratch / "frames").string() +
                                              " --size 128x96 --drift-ppm -50 --truth " + truth + " --seconds 0.05");
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_NE(result.output.find("\"ready\""), std::string::npos);
  EXPECT_NE(result.output.find("\"frames_sent\":0"), std::string::npos) << result.output;
  EXPECT_NEAR(read_json(truth)["rate_hz"].get<double>(), 60 * (1 - 50e-6), 1e-9);
}

TEST(Programs, APipeInPlaceOfAFileIsRefusedAndNotWaitedFor) {
  const Scratch scratch;
  const std::string pipe = (scratch / "pipe").string(), out = " --out " + (scratch / "out").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string camera = "camera --socket " + (scratch / "frames").string();
  for (const std::string& arguments :
       {"minibird --tcp 0 --faults " + pipe, camera + " --faults " + pipe, camera + " --post " + pipe,
        "case --ct " + pipe + out, "phantom --ct " + pipe + out, "operation --script " + pipe})
    expect_refused("birdseye-sim", arguments, {pipe + ": is no file but a pipe"});
}

TEST(Programs, WhatIsNoNumberIsNoLengthOfAnOperation) {
  const Scratch scratch;
  const std::string out = (scratch / "none").string();
  expect_refused("birdseye-sim", "operation --minutes nan", {"--minutes: nan is no number"});
  for (const std::string option : {"--minutes", "--at-most"})
    expect_refused("birdseye-sim", "campaign --seeds 1:2 --out " + out + " " + option + " nan",
                   {option + ": nan is no number"}, out);
  expect_refused("birdseye-sim", "campaign --seeds 1:1000000000 --out " + out, {"10000000 of them"}, out);
}

TEST(Programs, TellOneVersion) {
  std::string versions;
  for (const std::string program : {"birdseye-sim", "birdseye", "birdseyed"}) {
    const auto told = run(program, "--version");
    EXPECT_EQ(told.code, 0) << told.output;
    ASSERT_EQ(told.output.rfind(program + " ", 0), 0U) << told.output;
    const std::string version = told.output.substr(program.size() + 1);
    if (versions.empty()) versions = version;
    EXPECT_EQ(version, versions);
  }
}

TEST(Programs, WrongOptionsAreNamed) {
  const Scratch scratch;
  const auto fixed = run("birdseye-sim", "cart --phantom p --socket s --tty t --out o --reference table1");
  EXPECT_EQ(fixed.code, 2);
  EXPECT_NE(fixed.output.find("{patient,table}"), std::string::npos) << fixed.output;
  EXPECT_EQ(fixed.output.find("->"), std::string::npos) << fixed.output;
  EXPECT_EQ(run("birdseye-sim", "cart --help").output.find("->"), std::string::npos);
  const std::string tty = "--tty " + (scratch / "tty").string();
  expect_refused("birdseye-sim", "minibird", {"--tcp"});
  expect_refused("birdseye-sim", "minibird " + tty + " --tcp 0", {"--tcp", "2 were given"});
  expect_refused("birdseye-sim", "minibird --tcp somewhere", {"--tcp somewhere", "PORT"});
  expect_refused("birdseye-sim", "minibird " + tty + " --motion spiral", {"--motion"});
  expect_refused("birdseye-sim", "minibird " + tty + " --birds 0", {"--birds"});
  expect_refused("birdseye-sim", "minibird " + tty + " --revision three", {"--revision"});
  expect_refused("birdseye-sim", "minibird " + tty + " --faults /nonexistent", {"/nonexistent"});
  expect_refused("birdseye-sim", "minibird " + tty + " --truth /nonexistent/t.json", {"/nonexistent/t.json"});
  expect_refused("birdseye-sim", "minibird " + tty + " --faults " + scratch.file("f", "[[fault]]\nname = \"fire\"\n"),
                 {"line 2", "fire", "no such fault; all are in docs/manual/simulated-minibird.md"});
  expect_refused("birdseye-sim", "cart --phantom p --socket s --tty t --out o --deformation melt",
                 {"--deformation melt", "elastic", "pneumoperitoneum"});
  const std::string socket = "--socket " + (scratch / "frames").string();
  expect_refused("birdseye-sim", "camera", {"--v4l2"});
  expect_refused("birdseye-sim", "camera --v4l2 /dev/null", {"/dev/null", "v4l2loopback"});
  expect_refused("birdseye-sim", "camera " + socket + " --format MJPG", {"--format", "NV12"});
  expect_refused("birdseye-sim", "camera " + socket + " --size 101x100", {"--size", "even"});
  expect_refused("birdseye-sim", "camera " + socket + " --size big", {"--size"});
  expect_refused("birdseye-sim",
                 "camera " + socket + " --faults " + scratch.file("g", "[[fault]]\nname = \"drop_byte\"\nat_s = 1\n"),
                 {"line 1", "drop_byte", "no instrument"});
}

}  // namespace
}  // namespace birdseye
