#include "device/birdseyed/config.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>

#include "device/birdseyed/wire_admission.hpp"
#include "drivers/identity/this_machine.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

constexpr const char* kSound = R"([tracker]
device = "/dev/ttyUSB0"
birds = 2
names = ["scope", "pointer"]
rate_hz = 100
delay_ms = 7.5
[camera]
source = "v4l2:/dev/video0"
[wire]
port = 18945
[pose]
smoothing_ms = 40
)";

Result<Config> read(const std::string& text) {
  const auto path =
      std::filesystem::temp_directory_path() / ("birdseye-config-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(path) << text;
  auto config = read_config(path);
  std::filesystem::remove(path);
  return config;
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kSound;
  return text.replace(text.find(from), from.size(), to);
}

TEST(Config, TakesOnlyAWholeCalibrationRecord) {
  const auto path =
      std::filesystem::temp_directory_path() / ("birdseye-record-" + std::to_string(::getpid()) + ".json");
  const std::string text = record_text(testing::example_record(768, 576, {{"model", "a"}}, {{"model", "b"}}));
  const std::string with_record = kSound + std::string("[calibration]\nrecord = \"") + path.string() + "\"\n";
  const auto missing = read(with_record);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().what.find("[calibration] record: " + path.string()), std::string::npos)
      << missing.error().what;
  std::ofstream(path) << text.substr(0, text.size() - 9);
  EXPECT_FALSE(read(with_record));
  std::ofstream(path) << text;
  const auto sound = read(with_record);
  ASSERT_TRUE(sound) << sound.error().what;
  EXPECT_EQ(sound->core.calibration, text);
  std::filesystem::remove(path);
}

TEST(Config, ARecordOfNobodyKnownIsNotUsedUnlessAskedTo) {
  const testing::Scratch scratch;
  const auto record = testing::example_record(768, 576, {{"model", "a"}}, {{"model", "b"}});
  const auto signed_by = [&record](const ThisMachine& machine) {
    return record_text(record, machine.sign(calibration::kRecordFormat, signed_sha256(record)));
  };
  const auto refusal = [&](const std::string& text, const std::string& more = "") {
    const std::string path = scratch.file("record.json", text);
    const auto config = read(kSound + std::string("[calibration]\nrecord = \"") + path + "\"\n" + more);
    return config ? config->core.calibration_refused : config.error().what;
  };
  const auto own = ThisMachine::open();
  ASSERT_TRUE(own) << own.error().what;
  const ThisMachine other = ThisMachine::for_once();
  EXPECT_EQ(refusal(signed_by(*own)), "");
  EXPECT_NE(refusal(record_text(record)).find("not signed"), std::string::npos);
  EXPECT_NE(refusal(record_text(record)).find("accept_unsigned = true"), std::string::npos);
  EXPECT_NE(refusal(signed_by(other)).find("add the line \"NAME " + other.key().public_key().hex()), std::string::npos);
  for (const std::string& text : {record_text(record), signed_by(other)})
    EXPECT_EQ(refusal(text, "accept_unsigned = true\n"), "");
  // Nor one with an entry that rests on what nobody known signed.
  auto doubtful = record;
  doubtful.hand_eye->provenance.doubt = "the map of the field is not signed";
  const std::string of_own =
      record_text(doubtful, own->sign(calibration::kRecordFormat, calibration::signed_sha256(doubtful)));
  EXPECT_NE(refusal(of_own).find("rests on what no known machine signed (its hand-eye: the map"), std::string::npos)
      << refusal(of_own);
  EXPECT_EQ(refusal(of_own, "accept_unsigned = true\n"), "");
  auto copied = own->sign(calibration::kRecordFormat, std::string(64, '0'));
  EXPECT_NE(refusal(record_text(record, copied), "accept_unsigned = true\n").find("was changed since"),
            std::string::npos);
}

/// By another delay the latency would be taken off twice, or not whole.
TEST(Config, ARecordWhoseLatencyWasMeasuredWithAnotherDelayIsNotUsed) {
  const testing::Scratch scratch;
  const auto own = ThisMachine::open();
  ASSERT_TRUE(own) << own.error().what;
  const auto refusal = [&](std::optional<double> measured_ms, const std::string& camera, const std::string& more = "") {
    auto record = testing::example_record(768, 576, {{"model", "a"}}, {{"model", "b"}});
    record.latency->camera_delay_ms = measured_ms;
    const std::string path =
        scratch.file("record.json", record_text(record, own->sign(calibration::kRecordFormat, signed_sha256(record))));
    const auto config =
        read(replaced("[wire]", camera + "[wire]") + "[calibration]\nrecord = \"" + path + "\"\n" + more);
    return config ? config->core.calibration_refused : config.error().what;
  };
  const std::string set = "delay_ms = 83.1\n";
  EXPECT_NE(refusal(0, set).find("was measured with [camera] delay_ms = 0, which is 83.1 now; set it back"),
            std::string::npos)
      << refusal(0, set);
  EXPECT_NE(refusal(0, set, "accept_unsigned = true\n").find("delay_ms"), std::string::npos);
  EXPECT_NE(refusal(40, "").find("delay_ms = 40, which is not set now"), std::string::npos) << refusal(40, "");
  EXPECT_EQ(refusal(83.1, set), "");
  EXPECT_EQ(refusal(0, "delay_ms = 0\n"), "");
  EXPECT_NE(refusal(0, "").find("delay_ms = 0, which is not set now"), std::string::npos)
      << "half a period is taken off";
  EXPECT_EQ(refusal(std::nullopt, set), "") << "a record of before";
}

TEST(Config, ARecordThatIsBoundToNothingIsToldWithTheRemedy) {
  const testing::Scratch scratch;
  const auto told = [&scratch](const calibration::Identity& tracker, const calibration::Identity& camera) {
    const std::string path =
        scratch.file("record.json", record_text(testing::example_record(768, 576, tracker, camera)));
    const auto config = read(kSound + std::string("[calibration]\nrecord = \"") + path + "\"\n");
    return config ? config->calibration_unbound : config.error().what;
  };
  EXPECT_NE(told({}, {}).find("record.json: the record does not say which tracker"), std::string::npos) << told({}, {});
  EXPECT_NE(told({}, {}).find("birdseye calibrate record FILE --bind HOST"), std::string::npos);
  EXPECT_NE(told({{"model", "a"}}, {}).find("does not say which camera"), std::string::npos);
  EXPECT_EQ(told({{"model", "a"}}, {{"model", "b"}}), "");
}

TEST(Config, AMissingCameraIsOneFault) {
  const auto config = read("[tracker]\ndevice = \"/dev/ttyS0\"\n");
  ASSERT_FALSE(config);
  EXPECT_NE(config.error().what.find("[camera] source: is missing"), std::string::npos) << config.error().what;
  EXPECT_EQ(std::count(config.error().what.begin(), config.error().what.end(), '\n'), 0) << config.error().what;
  const auto empty = read("[tracker]\ndevice = \"/dev/ttyS0\"\n[camera]\nsource = \"\"\n");
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().what.find("[camera] source: \"\": give v4l2:DEVICE"), std::string::npos)
      << empty.error().what;
}

TEST(Config, AFieldMapThatIsNotThereHidesNoMistakeInTheRecord) {
  const auto config =
      read(kSound + std::string("[calibration]\nfield = \"/none/f.json\"\nrecord = \"/none/r.json\"\n"));
  ASSERT_FALSE(config);
  const std::string& what = config.error().what;
  EXPECT_NE(what.find("[calibration] field: /none/f.json: cannot be read"), std::string::npos) << what;
  EXPECT_NE(what.find("[calibration] record: /none/r.json: cannot be read"), std::string::npos) << what;
  EXPECT_EQ(what.find("unknown key"), std::string::npos) << what;
}

/// The parser, and what copies its tables, call themselves for each level: 8 000 of them ended the daemon.
TEST(Config, OneThatNestsWithoutEndIsRefusedWhateverHidesIt) {
  for (const std::string level : {"[", "[\"]\",", "[#]\n", "[']',"}) {
    std::string text = "x = ";
    for (int i = 0; i < 9'000; ++i) text += level;
    const auto config = read(text + "1" + std::string(9'000, ']'));
    ASSERT_FALSE(config) << level;
    EXPECT_NE(config.error().what.find("nests lists, tables or keys deeper"), std::string::npos) << config.error().what;
  }
}

TEST(Config, ADeviceInPlaceOfAFileIsRefusedByItsName) {
  const auto config = read(kSound + std::string("[calibration]\nfield = \"/dev/zero\"\nrecord = \"/dev/zero\"\n"));
  ASSERT_FALSE(config);
  for (const char* key : {"field", "record"}) {
    const std::string says = std::string("[calibration] ") + key + ": /dev/zero: is no file but";
    EXPECT_NE(config.error().what.find(says), std::string::npos) << config.error().what;
  }
}

TEST(Config, ReadsWhatItIsToldAndDefaultsTheRest) {
  const auto config = read(kSound);
  ASSERT_TRUE(config) << config.error().what;
  EXPECT_EQ(config->tracker.line.device, "/dev/ttyUSB0");
  EXPECT_EQ(config->tracker.minibird.birds, 2);
  EXPECT_EQ(config->tracker.minibird.delay.ns, 7'500'000);
  EXPECT_EQ(config->wire.port, 18945);
  EXPECT_EQ(config->wire.bind, "127.0.0.1");
  EXPECT_EQ(config->core.pose.smoothing.ns, 40'000'000);
  EXPECT_EQ(config->camera.width_px, 768);
  EXPECT_TRUE(config->core.transforms);
  EXPECT_FALSE(read(replaced("[wire]", "[wire]\ntransforms = false"))->core.transforms);
}

TEST(Config, PlainBeyondThisMachineIsAllowedOnlyWhereItIsAskedForAndIsSaid) {
  const auto beyond = read(replaced("[wire]", "[wire]\nbind = \"0.0.0.0\"")),
             plain = read(replaced("[wire]", "[wire]\nbind = \"0.0.0.0\"\nallow_plain = true")),
             here = read(replaced("[wire]", "[wire]\nallow_plain = true"));
  ASSERT_TRUE(beyond && plain && here);
  EXPECT_FALSE(beyond->wire.allow_plain);
  EXPECT_EQ(beyond->core.notice, "");
  EXPECT_EQ(admission_words(beyond->wire),
            "the wire: this machine's programs, and paired machines by TLS (birdseyed pair)");
  EXPECT_TRUE(plain->wire.allow_plain);
  EXPECT_EQ(plain->core.notice.rfind("the wire is plain", 0), 0U) << plain->core.notice;
  EXPECT_EQ(admission_words(plain->wire), plain->core.notice);
  EXPECT_EQ(here->core.notice, "");
  EXPECT_EQ(admission_words(here->wire), "");
}

/// A folder of keys that every program of this process takes for its machine's.
class CheckedWire : public ::testing::Test {
 protected:
  void SetUp() override { ::setenv("BIRDSEYE_IDENTITY", folder_.c_str(), 1); }
  void TearDown() override {
    if (before_) {
      ::setenv("BIRDSEYE_IDENTITY", before_->c_str(), 1);
    } else {
      ::unsetenv("BIRDSEYE_IDENTITY");
    }
  }
  static std::string fault_of(const std::string& bind) {
    WireConfig wire;
    wire.bind = bind;
    const auto checked = check_wire(wire);
    return checked ? "" : checked.error().what;
  }
  void say(const std::string& known) const {
    std::ofstream(folder_ / "known") << known;
    std::filesystem::permissions(folder_ / "known", std::filesystem::perms::owner_read);
  }

  testing::Scratch scratch_;
  std::filesystem::path folder_ = scratch_ / "identity";

 private:
  static std::optional<std::string> environment(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
  }
  std::optional<std::string> before_ = environment("BIRDSEYE_IDENTITY");
};

TEST_F(CheckedWire, WithoutAKeyIsSoundAndNoneIsMade) {
  EXPECT_EQ(fault_of("127.0.0.1"), "");
  EXPECT_EQ(fault_of("0.0.0.0"), "");
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

TEST_F(CheckedWire, AnAddressThatIsNoneOfThisMachinesIsAFault) {
  const std::string fault = fault_of("203.0.113.7");  // of a network for examples (RFC 5737)
  EXPECT_EQ(fault.rfind("[wire] bind 203.0.113.7: this machine has no such address", 0), 0U) << fault;
  EXPECT_EQ(std::count(fault.begin(), fault.end(), '\n'), 0) << fault;
}

TEST_F(CheckedWire, KeysThatAStartWouldRefuseAreAFaultBeyondThisMachineAlone) {
  ASSERT_TRUE(MachineKey::open(folder_));
  EXPECT_EQ(fault_of("0.0.0.0"), "");
  std::filesystem::permissions(folder_ / "key.pem", std::filesystem::perms::others_read,
                               std::filesystem::perm_options::add);
  const std::string readable = fault_of("0.0.0.0");
  EXPECT_NE(readable.find("key.pem: others than its owner may read"), std::string::npos) << readable;
  WireConfig wire;
  wire.bind = "0.0.0.0";
  const auto admission = admission_of(wire);
  ASSERT_FALSE(admission);
  EXPECT_EQ(readable, admission.error().what) << "what a start says";
  EXPECT_EQ(fault_of("127.0.0.1"), "");
}

TEST_F(CheckedWire, ALineOfTheKnownKeysThatCannotBeUsedIsAFault) {
  ASSERT_TRUE(MachineKey::open(folder_));
  say("theatre-3 KEY\n");
  const std::string fault = fault_of("0.0.0.0");
  EXPECT_NE(fault.find("known: line 1: is no machine's name and key"), std::string::npos) << fault;
  const std::string both = fault_of("203.0.113.7");
  EXPECT_NE(both.find("known: line 1"), std::string::npos) << both;
  EXPECT_NE(both.find("\n[wire] bind 203.0.113.7: this machine has no such address"), std::string::npos) << both;
}

/// What the log says, for as long as this is there.
class Logged {
 public:
  Logged() {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
  }
  ~Logged() { spdlog::set_default_logger(before_); }
  Logged(const Logged&) = delete;
  Logged& operator=(const Logged&) = delete;
  [[nodiscard]] std::ptrdiff_t lines() const {
    const std::string text = text_.str();
    return std::count(text.begin(), text.end(), '\n');
  }
  [[nodiscard]] bool has(const std::string& words) const { return text_.str().find(words) != std::string::npos; }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

TEST_F(CheckedWire, AFaultOfTheKnownKeysIsLoggedOnceUntilItChanges) {
  WireConfig wire;
  wire.bind = "0.0.0.0";
  const auto admission = admission_of(wire);
  ASSERT_TRUE(admission) << admission.error().what;
  KnownKeysWatch watch(admission->tls);
  const Logged logged;
  const auto wait_until_told = [&](bool is_fault) {
    const Deadline soon = Deadline::after(Duration::from_ms(20'000));
    while (watch.look().empty() == is_fault && !soon.passed()) sleep_for(Duration::from_ms(1));
    for (int i = 0; i < 10; ++i) {  // it is read again, and nothing is told
      sleep_for(Duration::from_ms(1));
      (void)watch.look();
    }
  };
  wait_until_told(false);
  EXPECT_EQ(logged.lines(), 0);
  say("theatre-3 KEY\n");
  wait_until_told(true);
  EXPECT_NE(watch.look().find("known: line 1: "), std::string::npos) << watch.look();
  EXPECT_EQ(logged.lines(), 1);
  EXPECT_TRUE(logged.has("mend or remove the line; until then the machines are let in that the file named before"));
  std::filesystem::remove(folder_ / "known");
  wait_until_told(false);
  EXPECT_EQ(watch.look(), "");
  EXPECT_EQ(logged.lines(), 2);
}

TEST(KnownKeysWatch, OfAWireOfThisMachineAloneSaysNothing) {
  KnownKeysWatch watch(nullptr);
  EXPECT_EQ(watch.look(), "");
  EXPECT_EQ(watch.look(), "");
}

TEST(Config, TwoBirdsMayNotHaveTransformsOfOneName) {
  const std::string alike = "\"laparoscope_left\", \"laparoscope_right\"";
  const auto config = read(replaced("\"scope\", \"pointer\"", alike));
  ASSERT_FALSE(config);
  EXPECT_NE(
      config.error().what.find("[wire] transforms: two birds' TRANSFORMs would both be called LaparoscopeToTracker"),
      std::string::npos)
      << config.error().what;
  std::string without = replaced("\"scope\", \"pointer\"", alike);
  without.replace(without.find("[wire]"), 6, "[wire]\ntransforms = false");
  EXPECT_TRUE(read(without));
}

TEST(Config, BirdsHaveNamesOfTheirOwnThatTdataCarries) {
  const std::pair<const char*, const char*> cases[] = {
      {R"("scope", "table-reference-left-hand-pointer")", "has 33 bytes, and TDATA carries 20"},
      {R"("scope", "scope")", "two birds are called \"scope\""},
      {R"("scope", "poin\u0000ter")", "bird 2's name has a control character"},
      {R"("scope", "poin\nter")", "bird 2's name has a control character"}};
  for (const auto& [names, expected] : cases) {
    for (const char* transforms : {"true", "false"}) {
      std::string text = replaced(R"("scope", "pointer")", names);
      text.replace(text.find("[wire]"), 6, std::string("[wire]\ntransforms = ") + transforms);
      const auto config = read(text);
      ASSERT_FALSE(config) << names;
      EXPECT_NE(config.error().what.find(expected), std::string::npos) << config.error().what;
      EXPECT_EQ(config.error().what.find('\n'), std::string::npos) << "it is told once: " << config.error().what;
    }
  }
  EXPECT_TRUE(read(replaced("\"pointer\"", "\"table-reference-left\"")));  // of 20
}

TEST(Config, PlacesThatCannotBeUsedAreRefusedByName) {
  const std::string long_path = "/tmp/" + std::string(103, 's');  // a socket's address holds 107
  const std::string shorter = long_path.substr(0, 107);
  const auto folder = [](const std::string& path) { return kSound + ("[record]\nfolder = \"" + path + "\"\n"); };
  const std::pair<std::string, std::string> cases[] = {
      {replaced("v4l2:/dev/video0", "socket:" + long_path), "[camera] source: a socket's path has at most 107 bytes"},
      {replaced("/dev/ttyUSB0", "unix:" + long_path), "[tracker] device: a socket's path has at most 107 bytes"},
      {replaced("/dev/ttyUSB0", "/dev/tty\\u0000USB0"), "[tracker] device: has a control character"},
      {replaced("[wire]", "[wire]\nbind = \"239.1.2.3\""), "[wire] bind: \"239.1.2.3\" is no machine's"},
      {replaced("[wire]", "[wire]\nbind = \"255.255.255.255\""), "[wire] bind: \"255.255.255.255\" is no machine's"},
      {folder("/dev/null"), "[record] folder: \"/dev/null\" is no folder"},
      {folder("/dev/null/in"), "[record] folder: \"/dev/null\" is no folder"}};
  for (const auto& [text, expected] : cases) {
    const auto config = read(text);
    ASSERT_FALSE(config) << expected;
    EXPECT_NE(config.error().what.find(expected), std::string::npos) << config.error().what;
  }
  for (const std::string& sound :
       {replaced("v4l2:/dev/video0", "socket:" + shorter), replaced("/dev/ttyUSB0", "unix:" + shorter),
        replaced("[wire]", "[wire]\nbind = \"0.0.0.0\""), folder("/nonexistent/record")}) {
    const auto config = read(sound);
    EXPECT_TRUE(config) << config.error().what;
  }
}

TEST(Config, OfManyUnknownKeysTheFirstAreNamedAndTheOthersCounted) {
  std::string text = kSound;
  for (int i = 0; i < 25; ++i) text += fmt::format("key{} = 1\n", i);
  for (int i = 0; i < 12; ++i) text += fmt::format("[part{}]\n", i);
  const auto config = read(text);
  ASSERT_FALSE(config);
  const std::string& what = config.error().what;
  EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 10 + 10 + 1) << what;
  for (const char* expected :
       {"[pose] key0: unknown key", "[pose] key9: unknown key", "[pose] and 15 more unknown keys",
        "part9: unknown section", "and 2 more unknown sections"})
    EXPECT_NE(what.find(expected), std::string::npos) << what;
  EXPECT_EQ(what.find("key10"), std::string::npos);
}

TEST(Config, AllMistakesAreToldAtOnceWithTheirLines) {
  const auto config = read("[tracker]\ndevice = \"/dev/ttyS0\"\nbaud = 1\n\n[camera]\nsource = 7\nzoom = 2\n[wires]\n");
  ASSERT_FALSE(config);
  const std::string& what = config.error().what;
  for (const char* expected : {".toml:3: [tracker] baud", ".toml:6: [camera] source: needs text",
                               ".toml:7: [camera] zoom: unknown key", ".toml:8: wires: unknown section"}) {
    EXPECT_NE(what.find(expected), std::string::npos) << what;
  }
  EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 3) << what;
}

TEST(Config, AMistakeHidesNoOtherAndIsToldOnce) {
  const auto config = read(
      "[tracker]\ndevice = \"/dev/ttyS0\"\nbirds = \"two\"\nrate_hz = nan\nreport_every = 3\n"
      "line_frequency_hz = 55\nnames = [\"a\", \"b\"]\n[camera]\nsource = \"x\"\nformat = \"y\"\n");
  ASSERT_FALSE(config);
  const std::string& what = config.error().what;
  for (const char* expected :
       {".toml:3: [tracker] birds", ".toml:4: [tracker] rate_hz: nan is not within", ".toml:5: [tracker] report_every",
        ".toml:6: [tracker] line_frequency_hz", ".toml:9: [camera] source", ".toml:10: [camera] format"})
    EXPECT_NE(what.find(expected), std::string::npos) << what;
  EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 5) << what;
}

TEST(Config, ABirdMayBeTheReference) {
  const auto config = read(replaced("birds = 2", "birds = 2\nreference = \"pointer\""));
  ASSERT_TRUE(config) << config.error().what;
  EXPECT_EQ(config->tracker.reference, "pointer");
  EXPECT_EQ(read(kSound)->tracker.reference, "");
}

TEST(Config, EveryMistakeIsNamed) {
  const std::pair<std::string, std::string> cases[] = {
      {replaced("rate_hz", "rate_herz"), "rate_herz: unknown key"},
      {replaced("[pose]", "[poses]"), "poses: unknown section"},
      {replaced("birds = 2", "birds = \"two\""), "[tracker] birds: needs a whole number"},
      {replaced("rate_hz = 100", "rate_hz = 500"), "[tracker] rate_hz: 500 is not within"},
      {replaced("port = 18945", "port = 99999"), "[wire] port"},
      {replaced("device = \"/dev/ttyUSB0\"", ""), "[tracker] device: is missing"},
      {replaced("/dev/ttyUSB0", ""), "[tracker] device: is empty; give the tracker's line"},
      {replaced("[wire]", "[gpio]\nchip = \"c\"\nstrobe = \"5\"\ntrigger = \"5\"\n[wire]"),
       "[gpio] trigger: \"5\" is the line of strobe too; give another"},
      {replaced("birds = 2", "birds = 3"), "2 names for 3 birds"},
      {replaced("birds = 2", "birds = 2\nreference = \"table\""), "[tracker] reference: \"table\" is none of"},
      {replaced("birds = 2", "birds = 2\nreference = \"scope\""), "[tracker] reference: \"scope\" is none of"},
      {replaced("\"scope\", \"pointer\"", "\"scope\", \"\""), "[tracker] names: bird 2 has no name"},
      {replaced("birds = 2", "birds = 2\nbaud = 9600"), "does not fit into 9600 baud"},
      {replaced("birds = 2", "birds = 2\nrecord = \"matrix\""), "record"},
      {replaced("birds = 2", "birds = 2\nbaud = 31250"), "31250 is none of 2400"},
      {replaced("[wire]", "width = 8000\nheight = 8000\n[wire]"), "[camera] width: over 16 megapixels"},
      {replaced("birds = 2", "birds = 2\nreport_every = 3"), ":4: [tracker] report_every: 3 is none of"},
      {replaced("v4l2:/dev/video0", "/dev/video0"), "[camera] source: \"/dev/video0\": give v4l2:DEVICE"},
      {replaced("v4l2:/dev/video0", "socket:"), "[camera] source: \"socket:\": give"},
      {replaced("[wire]", "format = \"H264\"\n[wire]"), "[camera] format: \"H264\": none that is read"},
      {replaced("[wire]", "[gpio]\nchip = \"c\"\npedal_bias = \"up\"\n[wire]"), "[gpio] pedal_bias: \"up\" is none of"},
      {replaced("[wire]", "[wire]\nbind = \"here\""), "[wire] bind: \"here\": give an IPv4"},
      {replaced("\"/dev/ttyUSB0\"", "/dev/ttyUSB0"), "texts need quotes"},
      {replaced("[wire]", "[wire"), "is not TOML"},
  };
  for (const auto& [text, expected] : cases) {
    const auto config = read(text);
    ASSERT_FALSE(config) << expected;
    EXPECT_NE(config.error().what.find(expected), std::string::npos) << config.error().what;
  }
  EXPECT_EQ(read_config("/nonexistent.toml").error().code, Errc::not_found);
  EXPECT_EQ(read("a = " + std::string(50'000, '[')).error().code, Errc::bad_format);
  EXPECT_NE(read_config("/tmp").error().what.find("is a folder"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::device
