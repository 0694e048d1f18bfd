#include <gtest/gtest.h>

#include "calibration/record/field_map_file.hpp"
#include "calibration/record/sha256.hpp"
#include "tests/support/example_record.hpp"

namespace birdseye::calibration {
namespace {

CalibrationRecord example() {
  CalibrationRecord record = testing::example_record(640, 480, {{"model", "miniBIRD"}, {"bird1_sensor_serial", "4711"}},
                                                     {{"model", "Scope cam"}});
  record.lens->round_field = RoundField{{311.5, 1.0 / 3}, 280};
  return record;
}

TEST(CalibrationRecord, IsReadBackExactly) {
  const std::string text = record_text(example());
  const auto read = parse_record(text);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(record_text(*read), text);
  EXPECT_EQ(read->tracker, example().tracker);
  EXPECT_EQ(read->lens->camera, example().lens->camera);
  EXPECT_EQ(read->lens->covariance, example().lens->covariance);
  EXPECT_EQ(read->lens->round_field, example().lens->round_field);
  EXPECT_EQ(read->hand_eye->camera_from_sensor.matrix(), example().hand_eye->camera_from_sensor.matrix());
  EXPECT_EQ(read->hand_eye->independent_stations, 14);
  ASSERT_TRUE(read->hand_eye->rod);
  const RodEntry& rod = *read->hand_eye->rod;
  EXPECT_EQ(rod.reference_angle_deg, example().hand_eye->rod->reference_angle_deg);
  EXPECT_EQ(rod.axis_in_sensor, example().hand_eye->rod->axis_in_sensor);
  EXPECT_EQ(rod.axis_point_in_sensor_mm, example().hand_eye->rod->axis_point_in_sensor_mm);
  EXPECT_EQ(rod.picture_turn, example().hand_eye->rod->picture_turn);
  EXPECT_EQ(read->tip->tip_in_sensor_mm, example().tip->tip_in_sensor_mm);
  EXPECT_EQ(read->latency->ci95_low_ms, 82.6);
  EXPECT_FALSE(read->latency->camera_delay_ms) << "nobody said it";
  EXPECT_EQ(read->lens->provenance.grade, Grade::marginal);
}

TEST(CalibrationRecord, KeepsTheDelayThatItsLatencyWasMeasuredWith) {
  CalibrationRecord record = example();
  EXPECT_EQ(record_text(record).find("camera_delay_ms"), std::string::npos);
  const std::string without = signed_sha256(record);
  record.latency->camera_delay_ms = 12.5;
  const auto read = parse_record(record_text(record));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->latency->camera_delay_ms, 12.5);
  EXPECT_NE(signed_sha256(record), without);
}

TEST(CalibrationRecord, MayBeLaidOutAnewButNotChanged) {
  std::string text = record_text(example());
  std::string spaced;
  for (const char c : text) {
    spaced += c;
    if (c == '\n') spaced += "   ";
  }
  EXPECT_TRUE(parse_record(spaced));
  // Every digit counts, wherever it stands.
  int digits = 0;
  for (std::size_t i = text.find("\"scope\""); i < text.size(); ++i) {
    if (text[i] < '1' || text[i] > '8') continue;
    std::string changed = text;
    ++changed[i];
    const auto read = parse_record(changed);
    if (read) {  // the digit was one too many to make another number
      ASSERT_EQ(record_text(*read), text) << i;
      continue;
    }
    EXPECT_NE(read.error().what.find("checksum"), std::string::npos) << read.error().what;
    ++digits;
  }
  EXPECT_GT(digits, 500);
}

TEST(CalibrationRecord, OneBitThatIsNotAsItWasIsRefused) {
  const std::string text = record_text(example());
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = static_cast<char>(changed[i] ^ (1 << (i % 8)));
    const auto read = parse_record(changed);
    if (!read) continue;
    // An "e" of a number may be an "E", and its last digit one too many to make another number.
    ASSERT_EQ(record_text(*read), text) << i;
  }
}

TEST(CalibrationRecord, Sha256IsThatOfTheStandard) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(CalibrationRecord, OneOf010WithItsOlderChecksumIsRead) {
  std::string old = R"({"format": "birdseye calibration record", "version": 1, "scope": "no. 17",
    "hardware": {"tracker": {"unit_serial": "4711"}, "camera": {"serial": "A1"}},
    "checksum": "crc64-ecma:59e29bcac2c87f3b"})";
  const auto read = parse_record(old);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->camera.at("serial"), "A1");
  EXPECT_NE(record_text(*read).find("sha256:"), std::string::npos) << "written anew, it has the stronger one";
  old.replace(old.find("4711"), 4, "4712");
  EXPECT_FALSE(parse_record(old));
}

TEST(CalibrationRecord, ACutOrForeignFileIsNoRecord) {
  const std::string text = record_text(example());
  for (std::size_t length = 0; length + 2 < text.size(); length += 7)
    EXPECT_FALSE(parse_record(text.substr(0, length))) << length;
  EXPECT_FALSE(parse_record("{}"));
  EXPECT_FALSE(parse_record("[1, 2]"));
  std::string later = text;
  later[later.find("\"version\": 1") + 11] = '2';
  const auto read = parse_record(later);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().what.find("version 2"), std::string::npos);
}

/// A parser of JSON goes on for as long as there are brackets; who copies or writes what it read calls itself for each.
TEST(CalibrationRecord, OneThatNestsWithoutEndIsNoRecordNorFieldMap) {
  constexpr std::size_t kDeep = 100'000;
  const std::string nested = std::string(kDeep, '[') + std::string(kDeep, ']');
  for (const std::string key : {"version", "lens"}) {
    const auto record = parse_record(R"({"format": "birdseye calibration record", ")" + key + "\": " + nested + "}");
    ASSERT_FALSE(record);
    EXPECT_NE(record.error().what.find("is no calibration record"), std::string::npos) << record.error().what;
  }
  const auto map = parse_field_map(R"({"format": "birdseye field map", "version": 1, "map": )" + nested + "}");
  ASSERT_FALSE(map);
  EXPECT_NE(map.error().what.find("nests"), std::string::npos) << map.error().what;
}

TEST(CalibrationRecord, NumbersThatMakeNoSenseAreRefusedWhateverTheirChecksum) {
  const auto refused = [](auto&& spoil, const std::string& word) {
    CalibrationRecord record = example();
    spoil(record);
    const auto read = parse_record(record_text(record));
    ASSERT_FALSE(read) << word;
    EXPECT_NE(read.error().what.find(word), std::string::npos) << read.error().what;
  };
  refused([](auto& r) { r.lens->camera.fx_px = -1; }, "focal");
  refused([](auto& r) { r.hand_eye->covariance(2, 2) = -1; }, "covariance");
  refused([](auto& r) { r.hand_eye->covariance(0, 1) = 5; }, "covariance");
  refused([](auto& r) { r.hand_eye->covariance(0, 1) = r.hand_eye->covariance(1, 0) = 5; }, "covariance");
  refused([](auto& r) { r.hand_eye->held_out_mm = -1; }, "held_out_mm is -1");
  refused([](auto& r) { r.lens->rms_px = 1e300; }, "rms_px is 1e+300");
  refused([](auto& r) { std::swap(r.latency->ci95_low_ms, r.latency->ci95_high_ms); }, "offset_ci95_ms");
  refused([](auto& r) { r.latency->offset_ms = -2e4; }, "offset_ms");
  refused([](auto& r) { r.latency->camera_delay_ms = -1; }, "camera_delay_ms is -1");
  refused([](auto& r) { r.hand_eye->rod->axis_in_sensor *= 2; }, "unit length");
  refused([](auto& r) { r.hand_eye->independent_stations = 0; }, "no stations");
  refused([](auto& r) { r.tip->provenance.grade = Grade::fail; }, "fail");
  refused([](auto& r) { r.lens->camera.k1 = std::numeric_limits<double>::quiet_NaN(); }, "null");
}

TEST(CalibrationRecord, AnotherLensTakesTheHandEyeAway) {
  CalibrationRecord record = example();
  EXPECT_FALSE(record.set_lens(*example().lens));
  EXPECT_TRUE(record.hand_eye);
  LensEntry other = *example().lens;
  other.camera.fx_px += 1;
  EXPECT_TRUE(record.set_lens(other));
  EXPECT_FALSE(record.hand_eye);
  EXPECT_FALSE(record.set_lens(*example().lens));  // there is none to take away
}

TEST(CalibrationRecord, FitsOnlyTheInstrumentItKnows) {
  const Identity recorded{{"model", "miniBIRD"}, {"bird1_sensor_serial", "4711"}};
  EXPECT_EQ(misfit("tracker", recorded, recorded), "");
  Identity more = recorded;
  more["bird2_sensor_serial"] = "12";  // a pointer that has come since
  EXPECT_EQ(misfit("tracker", recorded, more), "");
  Identity other = recorded;
  other["bird1_sensor_serial"] = "4712";
  EXPECT_NE(misfit("tracker", recorded, other).find("4712"), std::string::npos);
  EXPECT_NE(misfit("tracker", recorded, {{"model", "miniBIRD"}}).find("does not tell"), std::string::npos);
  EXPECT_NE(misfit("tracker", {}, recorded).find("bind"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::calibration
