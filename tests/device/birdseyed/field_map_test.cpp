// The field's map in the pose path: what the core publishes with one, and what the configuration makes of its file.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/record/field_map_file.hpp"
#include "device/birdseyed/config.hpp"
#include "device/birdseyed/core.hpp"
#include "device/birdseyed/recording.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "drivers/identity/this_machine.hpp"
#include "tests/support/core_session.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

using birdseye::testing::only;
using birdseye::testing::session;
using birdseye::testing::told;
using birdseye::testing::TrackerBytesSource;

const Eigen::Vector3d kShift(3, -2, 1);

/// Moves by kShift plus a hundredth of x, and turns about z; over all of the sensor's circle, or x up to high_x_mm.
calibration::FieldMap map(double high_x_mm = 700) {
  calibration::FieldMapData data;
  data.functions.low_mm = {100, -300, -100};
  data.functions.high_mm = {high_x_mm, 300, 200};
  const double half = (high_x_mm - 100) / 2;
  data.position_mm.assign(4, Eigen::Vector3d::Zero());
  data.position_mm[0] = kShift + Eigen::Vector3d(0.01 * (100 + half), 0, 0);
  data.position_mm[1] = {0.01 * half, 0, 0};
  data.rotation_rad.assign(4, Eigen::Vector3d::Zero());
  data.rotation_rad[0] = {0, 0, 1.0 / 30};
  data.sigma_mm.assign(9 * 9 * 9, 0.7);
  return *calibration::FieldMap::from(std::move(data));
}

CoreSettings with(calibration::FieldMap field) {
  CoreSettings settings;
  settings.field = std::move(field);
  return settings;
}

TEST(CoreWithAFieldMap, CorrectsEveryPose) {
  const auto events = session(6, 1);
  Core plain({}), mapped(with(map()));
  const auto before = only<wire::Birds>(told(plain, events)), after = only<wire::Birds>(told(mapped, events));
  ASSERT_GT(after.size(), 500U);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    const auto& measured = before[i].birds.at(0).tracker_from_sensor;
    const auto& corrected = after[i].birds.at(0).tracker_from_sensor;
    const Eigen::Vector3d wanted =
        measured.translation() + kShift + Eigen::Vector3d(0.01 * measured.translation().x(), 0, 0);
    EXPECT_LT((corrected.translation() - wanted).norm(), 1e-3);  // the wire's floats
    EXPECT_LT((corrected.rotation() - rotation_exp({0, 0, 1.0 / 30}) * measured.rotation()).norm(), 1e-5);
  }
  EXPECT_EQ(mapped.counters().tracker.of(drivers::minibird::DoubtKind::unmapped), 0U);
}

/// The map of another cart's field moves poses by what bends another room's.
TEST(CoreWithAFieldMap, PublishesNoPoseOfAnotherTracker) {
  CoreSettings settings = with(map());
  settings.field_of = {{"model", "miniBIRD 800"}, {"unit_serial", "4711"}};
  auto events = session(6, 1);
  const auto named = [&](const std::string& serial) {
    for (RawEvent& event : events) {
      auto* changed = std::get_if<InstrumentChanged>(&event);
      if (changed != nullptr && changed->instrument == Instrument::tracker)
        changed->identity = {{"model", "miniBIRD 800"}, {"unit_serial", serial}, {"bird1_sensor_serial", "9"}};
    }
  };
  const auto poses = [&] {
    Core core(settings);
    std::size_t out = 0;
    for (const auto& birds : only<wire::Birds>(told(core, events))) out += birds.birds.size();
    return std::pair{out, core.status_text()};
  };
  named("4711");
  EXPECT_GT(poses().first, 500U);
  named("4712");
  const auto [published, status] = poses();
  EXPECT_EQ(published, 0U);
  EXPECT_NE(status.find("the field's map is of tracker unit_serial 4711; this one's is 4712"), std::string::npos)
      << status;
}

TEST(CoreWithAFieldMap, FramesHaveTheCorrectedPose) {
  const auto events = session(6, 2);
  Core core(with(map()));
  int judged = 0;
  for (const auto& frame : only<wire::VideoFrame>(told(core, events))) {
    if (frame.info.sequence < 75 || !frame.info.pose.tracker_from_sensor) continue;
    ++judged;
    const Eigen::Vector3d truth =
        TrackerBytesSource::pose_at(static_cast<double>(frame.info.sequence) / 25).position_mm;
    const Eigen::Vector3d wanted = truth + kShift + Eigen::Vector3d(0.01 * truth.x(), 0, 0);
    EXPECT_LT((frame.info.pose.tracker_from_sensor->translation() - wanted).norm(), 0.7);
  }
  EXPECT_GT(judged, 50);
}

/// A map of before such places were left out of it: made from two levels, it is sure at these and not between them.
TEST(CoreWithAFieldMap, WhereTheMapIsNotSurePosesAreDoubtedInWords) {
  const auto events = session(6, 4);
  calibration::FieldMapData data = map().data();
  data.sigma_mm.assign(9 * 9 * 9, 5.8);
  Core core(with(*calibration::FieldMap::from(std::move(data))));
  const auto said = told(core, events);
  EXPECT_TRUE(only<wire::Birds>(said).empty());
  EXPECT_GT(core.counters().tracker.of(drivers::minibird::DoubtKind::unmapped), 500U);
  bool doubted = false;
  for (const auto& doubt : only<wire::Doubt>(said))
    doubted = doubted || doubt.why.find("the map of the field is sure to 5.8 mm, of at most 2.5") != std::string::npos;
  EXPECT_TRUE(doubted);
}

TEST(CoreWithAFieldMap, OutsideTheMapPosesAreDoubtedInWords) {
  const auto events = session(8, 3);
  Core core(with(map(450)));  // the circle goes to x = 600
  const auto said = told(core, events);
  const auto birds = only<wire::Birds>(said);
  ASSERT_GT(birds.size(), 300U);
  for (const auto& one : birds) EXPECT_LE(one.birds.at(0).tracker_from_sensor.translation().x(), 450 + 3 + 4.5 + 1e-3);
  EXPECT_GT(core.counters().tracker.of(drivers::minibird::DoubtKind::unmapped), 200U);
  bool doubted = false;
  for (const auto& doubt : only<wire::Doubt>(said))
    doubted = doubted || doubt.why.find("outside the mapped field (100..450") != std::string::npos;
  EXPECT_TRUE(doubted);
  bool in_status = false;
  for (const auto& status : only<wire::Status>(said))
    in_status = in_status || status.text.find("scope: at ") != std::string::npos;
  EXPECT_TRUE(in_status);
  int refused = 0;
  for (const auto& frame : only<wire::VideoFrame>(said)) {
    const double angle = 3.14159265358979 * static_cast<double>(frame.info.sequence) / 25;
    if (400 + 200 * std::cos(angle) < 550 || frame.info.sequence < 75) continue;
    ++refused;
    EXPECT_EQ(frame.info.pose.kind, PoseKind::refused);
    EXPECT_NE(frame.info.pose.reason.find("outside the mapped field"), std::string::npos) << frame.info.pose.reason;
  }
  EXPECT_GT(refused, 10);
}

void replays_to_the_same_bytes(const CoreSettings& settings, const std::vector<RawEvent>& events) {
  const birdseye::testing::Scratch scratch;
  Bytes bytes = recording_magic();
  const auto put = [&bytes](const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
  put(block_of(settings));
  for (const RawEvent& event : events) put(block_of(event));
  auto reader = RawEventReader::open(scratch.file("r.berec", {bytes.begin(), bytes.end()}));
  ASSERT_TRUE(reader) << reader.error().what;
  ASSERT_TRUE(reader->settings().field);
  Core live(settings), again(reader->settings());
  for (const RawEvent& event : events) {
    const auto read = reader->next();
    ASSERT_TRUE(read && *read);
    const auto a = live.take(event);
    const auto b = again.take(**read);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(a[i].bytes(), b[i].bytes());
  }
}

TEST(CoreWithAFieldMap, AMapOfNobodyKnownLetsNoPoseThrough) {
  CoreSettings settings = with(map());
  settings.field_refused = "field.json: the map of the field is not signed";
  Core core(settings);
  const auto said = told(core, session(4, 1));
  ASSERT_FALSE(only<wire::Status>(said).empty());
  EXPECT_NE(only<wire::Status>(said).front().text.find(settings.field_refused), std::string::npos)
      << only<wire::Status>(said).front().text;
  for (const auto& birds : only<wire::Birds>(said)) EXPECT_TRUE(birds.birds.empty());
  for (const auto& frame : only<wire::VideoFrame>(said)) EXPECT_FALSE(frame.info.pose.tracker_from_sensor);
  EXPECT_NE(core.status_text().find(settings.field_refused), std::string::npos) << core.status_text();
  EXPECT_NE(core.status_text().find("scope: the map of the tracker's field is not used"), std::string::npos);
}

TEST(CoreWithAFieldMap, ReplaysToTheSameBytes) {
  const auto events = session(4, 4);
  CoreSettings settings = with(map(450));
  replays_to_the_same_bytes(settings, events);
  settings.field_refused = "field.json: the map of the field is not signed";
  replays_to_the_same_bytes(settings, events);
}

TEST(CoreWithAFieldMap, ARecordingWhoseMapIsNoneIsRefused) {
  const Bytes good = block_of(with(map()));
  constexpr std::size_t kHead = 12, kCheck = 8;
  const auto settings = nlohmann::json::parse(good.begin() + kHead, good.end() - kCheck);
  const birdseye::testing::Scratch scratch;
  const auto opens = [&](const nlohmann::json& json) {
    const std::string text = json.dump();
    Bytes block(kHead);
    block[0] = 1;
    for (std::size_t i = 0; i < 8; ++i) block[4 + i] = static_cast<std::uint8_t>(text.size() >> 8 * i);
    block.insert(block.end(), text.begin(), text.end());
    const std::uint64_t check = wire::checksum(block);
    for (std::size_t i = 0; i < kCheck; ++i) block.push_back(static_cast<std::uint8_t>(check >> 8 * i));
    Bytes bytes = recording_magic();
    bytes.insert(bytes.end(), block.begin(), block.end());
    return RawEventReader::open(scratch.file("r.berec", {bytes.begin(), bytes.end()})).has_value();
  };
  EXPECT_TRUE(opens(settings));
  auto short_of_one = settings, no_kind = settings;
  short_of_one["field"]["position_mm"].erase(0);
  EXPECT_FALSE(opens(short_of_one));
  no_kind["field"]["kind"] = "splines";
  EXPECT_FALSE(opens(no_kind));
}

std::string config_with(const std::string& field) {
  return "[tracker]\ndevice = \"/dev/ttyS0\"\n[camera]\nsource = \"v4l2:/dev/video0\"\n[calibration]\nfield = \"" +
         field + "\"\n";
}

TEST(ConfigOfAFieldMap, IsReadExactly) {
  const birdseye::testing::Scratch scratch;
  const auto file = scratch.file("field.json", calibration::field_map_text(map(), {"2026-11-22T09:30:00Z", "birdseye",
                                                                                   "180 places", Grade::pass, 0.4}));
  const auto config = read_config(scratch.file("c.toml", config_with(file)));
  ASSERT_TRUE(config) << config.error().what;
  ASSERT_TRUE(config->core.field);
  for (const double x : {100.1, 300.7, 699.3})
    EXPECT_EQ(*config->core.field->correction_mm({x, 1.0 / 3, 7}), *map().correction_mm({x, 1.0 / 3, 7}));
}

TEST(ConfigOfAFieldMap, OfNobodyKnownIsNotUsedUnlessAskedTo) {
  const calibration::FieldMapNotes notes{"2026-11-22T09:30:00Z", "birdseye", "180 places", Grade::pass, 0.4};
  const auto signed_by = [&notes](const ThisMachine& machine) {
    return calibration::field_map_text(
        map(), notes, machine.sign(calibration::kFieldMapFormat, calibration::signed_sha256(map(), notes)));
  };
  const birdseye::testing::Scratch scratch;
  const auto refusal = [&](const std::string& text, const std::string& more = "") {
    const auto config = read_config(scratch.file("c.toml", config_with(scratch.file("field.json", text)) + more));
    return config ? config->core.field_refused : config.error().what;
  };
  const auto own = ThisMachine::open();
  ASSERT_TRUE(own) << own.error().what;
  const ThisMachine other = ThisMachine::for_once();
  const std::string unsigned_map = calibration::field_map_text(map(), notes);
  EXPECT_EQ(refusal(signed_by(*own)), "");
  EXPECT_NE(refusal(unsigned_map).find("field.json: the map of the field is not signed"), std::string::npos);
  EXPECT_NE(refusal(unsigned_map).find("accept_unsigned = true"), std::string::npos);
  EXPECT_NE(refusal(signed_by(other)).find("add the line \"NAME " + other.key().public_key().hex()), std::string::npos);
  const std::string own_map = signed_by(*own);  // made once: a signature says the second of its making
  for (const std::string& text : {unsigned_map, signed_by(other), own_map}) {
    const auto used =
        read_config(scratch.file("c.toml", config_with(scratch.file("field.json", text)) + "accept_unsigned = true\n"));
    ASSERT_TRUE(used) << used.error().what;
    EXPECT_EQ(used->core.field_refused, "");
    const bool known = text == own_map;
    EXPECT_EQ(used->core.notice.starts_with("UNSIGNED: the map of the field is "), !known) << used->core.notice;
    EXPECT_EQ(used->core.field_unsigned.empty(), known);
  }
  const auto copied = own->sign(calibration::kFieldMapFormat, std::string(64, '0'));
  EXPECT_NE(
      refusal(calibration::field_map_text(map(), notes, copied), "accept_unsigned = true\n").find("was changed since"),
      std::string::npos);
}

TEST(ConfigOfAFieldMap, AFileThatIsMissingOrDamagedIsAFaultWithItsLine) {
  const birdseye::testing::Scratch scratch;
  const std::string good =
      calibration::field_map_text(map(), {"2026-11-22T09:30:00Z", "birdseye", "180 places", Grade::pass, 0.4});
  const auto what = [&](const std::string& file) {
    const auto config = read_config(scratch.file("c.toml", config_with(file)));
    return config ? "it was taken" : config.error().what;
  };
  EXPECT_NE(what((scratch / "none.json").string()).find(":6: [calibration] field: "), std::string::npos)
      << what((scratch / "none.json").string());
  EXPECT_NE(what(scratch.path().string()).find("[calibration] field"), std::string::npos);
  EXPECT_NE(what(scratch.file("cut.json", good.substr(0, good.size() / 2))).find("not a whole one"), std::string::npos);
  std::string changed = good;
  changed.replace(changed.find("0.7"), 3, "0.1");
  EXPECT_NE(what(scratch.file("changed.json", changed)).find("checksum"), std::string::npos);
  EXPECT_NE(what(scratch.file("other.json", "{\"a\": 1}")).find("birdseye calibrate field"), std::string::npos);
  EXPECT_EQ(what(scratch.file("good.json", good)), "it was taken");
}

}  // namespace
}  // namespace birdseye::device
