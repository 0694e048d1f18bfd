#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calibration/record/field_map_file.hpp"
#include "device/birdseyed/recorder.hpp"
#include "host/operation/operation.hpp"
#include "host/recording/recording_writer.hpp"
#include "tests/support/command.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;

using testing::authors;
using testing::Scratch;

void expect(const std::string& arguments, int code, const std::vector<std::string>& words,
            const std::string& within = {}) {
  const auto result = testing::run("birdseye", "verify " + arguments, within);
  EXPECT_EQ(result.code, code) << arguments << "\n" << result.output;
  for (const std::string& word : words)
    EXPECT_NE(result.output.find(word), std::string::npos) << word << "\n" << result.output;
}

calibration::CalibrationRecord record() {
  return testing::example_record(640, 480, {{"model", "miniBIRD"}}, {});
}

void record_session(const fs::path& folder) {
  const auto writer = host::RecordingWriter::create({.folder = folder, .source = "test", .machine = authors().machine});
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->finish("the test is over"));
}

TEST(VerifyCommand, SaysByWhomAndWhenEachKindWasSigned) {
  const Scratch scratch;
  (void)scratch.file("record.json", testing::signed_record_text(record()));
  host::Operation operation;
  operation.ct_sha256 = "1";
  fs::create_directory(scratch / "operation");
  ASSERT_TRUE(host::write_operation(scratch / "operation", operation, *authors().machine));
  record_session(scratch / "session");
  const std::string by = "signed by " + machine_name() + " (" + authors().machine->key().public_key().fingerprint();
  calibration::FieldMapData field;
  field.functions.low_mm = {100, -300, -100};
  field.functions.high_mm = {700, 300, 200};
  field.position_mm.assign(4, Eigen::Vector3d(1, 2, 3));
  field.sigma_mm.assign(9 * 9 * 9, 0.7);
  const auto map = calibration::FieldMap::from(std::move(field));
  const calibration::FieldMapNotes notes{"2026-11-22T09:30:00Z", "birdseye", "180 places", Grade::pass, 0.4};
  const auto signature = authors().machine->sign(calibration::kFieldMapFormat, signed_sha256(*map, notes));
  (void)scratch.file("field.json", calibration::field_map_text(*map, notes, signature));
  for (const auto& [name, what] : {std::pair{"record.json", ": calibration record: "},
                                   {"field.json", ": map of the field: "},
                                   {"operation", ": operation: "},
                                   {"session", ": session recording: "}}) {
    expect((scratch / name).string(), 0, {std::string(name) + what + by, "and as it was signed"});
  }
  expect((scratch / "record.json").string() + " " + (scratch / "session").string(), 0, {"record.json: ", "session: "});
  nlohmann::ordered_json turned;
  const auto sorted = nlohmann::json::parse(testing::contents_of(scratch / "field.json"));
  for (auto one = sorted.rbegin(); one != sorted.rend(); ++one) turned[one.key()] = one.value();
  expect(scratch.file("turned.json", turned.dump()), 0, {": map of the field: " + by, "and as it was signed"});
}

TEST(VerifyCommand, NoNameInAFileStandsForALineOfItsOwn) {
  const Scratch scratch;
  record_session(scratch / "session");
  (void)scratch.file("session/more\x1b[2K\rsession: as it was signed\n.txt", "");
  const auto result = testing::run("birdseye", "verify " + (scratch / "session").string());
  EXPECT_EQ(result.code, 3);
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 2) << result.output;
  EXPECT_EQ(result.output.find_first_of("\x1b\r"), std::string::npos) << result.output;
}

TEST(VerifyCommand, SaysWhatWasChanged) {
  const Scratch scratch;
  std::string text = testing::signed_record_text(record());
  text.replace(text.find("640"), 3, "641");
  expect(scratch.file("record.json", text), 3, {"calibration record: ", "checksum does not fit"});
  expect(scratch.file("field.json", R"({"format": "birdseye field map", "version": 1})"), 3,
         {"map of the field: ", "not a whole one"});
  record_session(scratch / "session");
  (void)scratch.file("session/events.jsonl", "{}\n");
  (void)scratch.file("session/more.txt", "");
  expect((scratch / "session").string(), 3, {"changed: events.jsonl", "added: more.txt", "not as it was signed"});
  host::Operation operation;
  operation.ct_sha256 = "12345";
  fs::create_directory(scratch / "operation");
  ASSERT_TRUE(host::write_operation(scratch / "operation", operation, *authors().machine));
  text = testing::contents_of(scratch / "operation/operation.json");
  (void)scratch.file("operation/operation.json", text.replace(text.find("12345"), 5, "12346"));
  expect((scratch / "operation").string(), 3, {"its part \"ct\" was changed or damaged"});
}

TEST(VerifyCommand, SaysWhatNobodySigned) {
  const Scratch scratch;
  expect(scratch.file("other.json", R"({"format": {"name": "x"}})"), 3,
         {": no record, map of the field or operation, or damaged: "});
  expect(scratch.file("record.json", calibration::record_text(record())), 3, {"not signed: nobody says who wrote it"});
  record_session(scratch / "session");
  (void)scratch.file("session/recording.json", R"({"birdseye_recording": 1, "ended": false})");
  expect((scratch / "session").string(), 3, {"not signed", "it was cut short"});
}

TEST(VerifyCommand, MakesAMachineKnownByWhatItSigned) {
  const Scratch scratch;
  const std::string path = scratch.file("record.json", testing::signed_record_text(record()));
  const std::string elsewhere = "env BIRDSEYE_IDENTITY=" + (scratch / "elsewhere").string();
  expect(path, 3, {"not known here", authors().machine->key().public_key().fingerprint()}, elsewhere);
  expect("--trust theatre-3 " + path, 0, {"signed by theatre-3 ("}, elsewhere);
  expect(path, 0, {"signed by theatre-3 ("}, elsewhere);
  expect("--key", 0, {"fingerprint "}, elsewhere);
  for (const char* name : {"own", "..", "a/b"}) {
    testing::expect_refused("birdseye", std::string("verify --trust ") + name + " " + path,
                            {"--trust: \"" + std::string(name) + "\" is no name of a machine"}, "",
                            "env BIRDSEYE_IDENTITY=" + (scratch / "third").string());
  }
  // Nobody becomes known by what is not signed, or not as it was.
  expect("--trust nobody " + scratch.file("unsigned.json", calibration::record_text(record())), 3, {"not signed"},
         elsewhere);
}

TEST(VerifyCommand, OfAnApplianceRecordingSeesEachByte) {
  const Scratch scratch;
  (void)authors();  // and with it this machine's key
  device::RecordConfig config;
  config.folder = scratch / "r";
  fs::path path;
  {
    const auto recorder = device::Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    path = (*recorder)->path();
    for (std::uint8_t i = 0; i < 9; ++i) (*recorder)->take(device::TrackerBytes{{{0x80, i}, DeviceTime{i}}});
  }
  expect(path.string(), 0, {": appliance recording: signed by " + machine_name(), "and as it was signed"});
  const std::string text = testing::contents_of(path);
  for (const std::size_t at : {std::size_t{9}, text.size() / 4, text.size() / 2, text.size() - 100}) {
    std::string changed = text;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    expect(scratch.file("changed.berec", changed), 3, {": appliance recording: "});
  }
  std::string changed = text;
  changed[text.rfind("{\"key\":") - 12] ^= 1;  // so that its block is of another kind
  expect(scratch.file("changed.berec", changed), 3, {"damaged in its signature; take a copy"});
  expect(scratch.file("longer.berec", text + "x"), 3, {"added: bytes behind the signature"});
  expect(scratch.file("cut.berec", text.substr(0, text.size() - 1)), 3, {"not signed", "cut short"});
}

/// A calibration that went by it would be signed by this machine, and the change with it.
TEST(VerifyCommand, ACalibrationTakesNoPosesOfARecordingThatItWouldRefuse) {
  const Scratch scratch;
  record_session(scratch / "changed");
  (void)scratch.file("changed/tracker.igs.mha", "put in later");
  {
    const auto writer = host::RecordingWriter::create({.folder = scratch / "nobodys", .source = "test"});
    ASSERT_TRUE(writer && (*writer)->finish("the test is over"));
  }
  const std::string other = scratch.file("other.csv", "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n");
  for (const std::string name : {"changed", "nobodys"}) {
    const std::string folder = (scratch / name).string();
    const std::string file = folder + "/tracker.igs.mha";  // of the recording, whoever names it
    for (const std::string& command :
         {"tip --poses " + folder, "tip --poses " + file, "latency --poses " + other + " --eye-poses " + file,
          "tip --poses " + other + " --spin " + folder, "latency --poses " + folder + " --eye-poses " + other,
          "latency --poses " + other + " --eye-poses " + folder, "hand-eye --poses " + folder + " --eye-poses " + other,
          "hand-eye --poses " + other + " --eye-poses " + folder, "field --pair " + other + " " + folder,
          "field --grid-spec 2x2x2:100x100x100mm --poses " + folder}) {
      testing::expect_refused("birdseye", "calibrate " + command,
                              {name, name == "changed" ? "since the recording was signed: tracker.igs.mha"
                                                       : "is not signed: nobody says who wrote it"});
    }
  }
}

/// Nothing of them is signed, and nothing has to be judged.
TEST(VerifyCommand, ACalibrationFromFilesOfPosesNeedsNoKey) {
  const Scratch scratch;
  const std::string a = scratch.file("a.csv", "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n");
  const std::string b = scratch.file("b.csv", "t,x,y,z,qx,qy,qz,qw\n0,1,0,0,0,0,0,1\n");
  const std::string without = "env BIRDSEYE_IDENTITY=/proc/none";
  for (const std::string command : {"latency --poses ", "hand-eye --poses "}) {
    const auto result = testing::run("birdseye", "calibrate " + command + a + " --eye-poses " + b, without);
    EXPECT_EQ(result.output.find("/proc/none"), std::string::npos) << result.output;
  }
}

TEST(VerifyCommand, RefusesWhatItCannotJudge) {
  const Scratch scratch;
  testing::expect_refused("birdseye", "verify " + (scratch / "none").string(), {"no such file or folder"});
  testing::expect_refused("birdseye", "verify " + scratch.file("some.txt", "text"), {"nothing that Birdseye signs"});
  testing::expect_refused("birdseye", "verify", {"name a record, a map of the field, an operation or a recording"});
  testing::expect_refused("birdseye", "verify " + scratch.file("record.json", calibration::record_text(record())),
                          {"HOME is not set"}, {},
                          "env -u BIRDSEYE_IDENTITY -u HOME -u XDG_CONFIG_HOME -u STATE_DIRECTORY");
}

}  // namespace
}  // namespace birdseye
