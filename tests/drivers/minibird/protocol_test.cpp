#include "drivers/minibird/protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/base/units.hpp"
#include "drivers/minibird/record_parser.hpp"
#include "drivers/minibird/unit_status.hpp"

namespace birdseye::drivers::minibird {
namespace {

using ::testing::ElementsAre;
using Words = std::vector<std::int16_t>;

struct Vector {
  const char* id;
  RecordFormat format;
  Bytes bytes;
  Words words;
};

const Bytes kT05{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20};
const Bytes kSecond{0xE3, 0x71, 0x1C, 0x16, 0x47, 0x23, 0x2A, 0x55, 0x2A, 0x05, 0x1C, 0x7E};

const Vector kVectors[] = {
    {"T01", RecordFormat::position, {0xC8, 0x08, 0x51, 0x19, 0x59, 0x2A}, {4384, 13124, 21860}},
    {"T02", RecordFormat::position, {0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05}, {9100, -4780, 2728}},
    {"T03", RecordFormat::position, {0xF1, 0x08, 0x2A, 0x7B, 0x55, 0x02}, {4548, -2392, 1364}},
    {"T04", RecordFormat::angles, {0x80, 0x10, 0x2A, 0x75, 0x00, 0x20}, {8192, -5464, 16384}},
    {"T05", RecordFormat::position_angles, kT05, {9100, -4780, 2728, 8192, -5464, 16384}},
    {"T06",
     RecordFormat::matrix,
     {0x8A, 0x34, 0x63, 0x63, 0x1C, 0x18, 0x09, 0x1E, 0x3E, 0x38, 0x13, 0x01, 0x0E, 0x6A, 0x38, 0x0A, 0x1D, 0x3B},
     {26664, -14452, 12400, 15396, 28920, 588, -11208, 5344, 30324}},
    {"T07", RecordFormat::quaternion, {0xF3, 0x3C, 0x47, 0x7D, 0x71, 0x73, 0x57, 0x70}, {31180, -1252, -6204, -7844}},
    {"T08",
     RecordFormat::position_quaternion,
     {0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x73, 0x3C, 0x47, 0x7D, 0x71, 0x73, 0x57, 0x70},
     {9100, -4780, 2728, 31180, -1252, -6204, -7844}},
    {"T09",
     RecordFormat::position_matrix,
     {0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x0A, 0x34, 0x63, 0x63, 0x1C, 0x18,
      0x09, 0x1E, 0x3E, 0x38, 0x13, 0x01, 0x0E, 0x6A, 0x38, 0x0A, 0x1D, 0x3B},
     {9100, -4780, 2728, 26664, -14452, 12400, 15396, 28920, 588, -11208, 5344, 30324}},
};

TEST(Record, DecodesThePublishedVectorsExactly) {
  for (const Vector& v : kVectors) {
    RecordParser parser({v.format}, false, false);
    const auto records = parser.push(v.bytes);
    ASSERT_EQ(records.size(), 1U) << v.id;
    EXPECT_EQ(records[0].words, v.words) << v.id;
    EXPECT_EQ(parser.phase_errors(), 0U) << v.id;
  }
}

TEST(Record, PosesOfThePublishedVectors) {
  const auto t02 = decode_pose(RecordFormat::position, kVectors[1].words, kMmPerCount36Inch);
  ASSERT_TRUE(t02);
  EXPECT_LT((*t02->position_mm - Eigen::Vector3d(253.9380, -133.3872, 76.1256)).norm(), 2e-4);
  const auto t03 = decode_pose(RecordFormat::position, kVectors[2].words, kMmPerCount72Inch);
  EXPECT_LT((*t03->position_mm - Eigen::Vector3d(253.8264, -133.4988, 76.1256)).norm(), 2e-4);
  const auto t04 = decode_pose(RecordFormat::angles, kVectors[3].words, kMmPerCount36Inch);
  const Eigen::Matrix3d expected = rotation_from_angles(45.0 * kRadPerDeg, -30.01465 * kRadPerDeg, 90.0 * kRadPerDeg);
  EXPECT_LT((*t04->rotation - expected).norm(), 1e-6);

  const auto matrix = decode_pose(RecordFormat::matrix, kVectors[5].words, kMmPerCount36Inch);
  const auto quaternion = decode_pose(RecordFormat::quaternion, kVectors[6].words, kMmPerCount36Inch);
  Eigen::Matrix3d published;
  published << 0.81372, -0.44104, 0.37842, 0.46985, 0.88257, 0.01794, -0.34204, 0.16309, 0.92542;
  // Two counts of 4/32768 for the words, and the orthonormalisation that follows.
  EXPECT_LT((*matrix->rotation - published).cwiseAbs().maxCoeff(), 2.5e-4);
  EXPECT_LT((*quaternion->rotation - published).cwiseAbs().maxCoeff(), 4e-4);
  const Eigen::Matrix3d angles = rotation_from_angles(30 * kRadPerDeg, 20 * kRadPerDeg, 10 * kRadPerDeg);
  EXPECT_LT((*matrix->rotation - angles).cwiseAbs().maxCoeff(), 4e-4);
}

TEST(Record, RefusesWhatNoPoseSends) {
  EXPECT_FALSE(decode_pose(RecordFormat::matrix, Words(9, 0), 1));
  EXPECT_FALSE(decode_pose(RecordFormat::quaternion, Words(4, 0), 1));
  EXPECT_FALSE(decode_pose(RecordFormat::angles, Words{0, 20000, 0}, 1));
  EXPECT_FALSE(decode_pose(RecordFormat::position, Words{0, 1}, 1));
  Words reflected = kVectors[5].words;
  for (std::size_t i = 0; i < 3; ++i) reflected[i] = static_cast<std::int16_t>(-reflected[i]);
  EXPECT_FALSE(decode_pose(RecordFormat::matrix, reflected, 1));
}

TEST(Record, SingleWords) {
  EXPECT_EQ(decode_word(0x00, 0x00), 0);
  EXPECT_EQ(decode_word(0x81, 0x00), 4);
  EXPECT_EQ(decode_word(0xFF, 0x7F), -4);
  EXPECT_EQ(decode_word(0xFF, 0x3F), 0x7FFC);
  EXPECT_EQ(decode_word(0x80, 0x40), -32768);
  EXPECT_EQ(decode_word(0x80, 0x20), 0x4000);
  EXPECT_EQ(decode_word(0x80, 0x60), -16384);
}

TEST(Record, T10GroupAndButtonMode) {
  Bytes bytes = kT05;
  bytes.insert(bytes.end(), {0x10, 0x01});
  bytes.insert(bytes.end(), kSecond.begin(), kSecond.end());
  bytes.insert(bytes.end(), {0x00, 0x02});
  RecordParser parser({RecordFormat::position_angles, RecordFormat::position_angles}, true, true);
  const auto records = parser.push(bytes);
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(records[0].button, 0x10);
  EXPECT_EQ(records[0].address, 1);
  EXPECT_EQ(records[0].begin, 0);
  EXPECT_EQ(records[1].begin, 14);
  EXPECT_EQ(records[1].button, 0);
  EXPECT_EQ(records[1].address, 2);
  EXPECT_EQ(records[1].words, (Words{-7284, 11376, 18204, -21848, 2728, -912}));
}

TEST(Record, T11ResynchronisesAfterALostByte) {
  Bytes bytes = kT05;
  bytes.erase(bytes.begin() + 3);
  bytes.insert(bytes.end(), kSecond.begin(), kSecond.end());
  RecordParser parser({RecordFormat::position_angles}, false, false);
  const auto records = parser.push(bytes);
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(parser.phase_errors(), 1U);
  EXPECT_EQ(records[0].words, (Words{-7284, 11376, 18204, -21848, 2728, -912}));
}

TEST(Record, T12HuntsForTheFirstRecord) {
  Bytes bytes{0x11, 0x7F};
  bytes.insert(bytes.end(), kT05.begin(), kT05.end());
  bytes.insert(bytes.end(), kSecond.begin(), kSecond.end());
  RecordParser parser({RecordFormat::position_angles}, false, false);
  EXPECT_EQ(parser.push(bytes).size(), 2U);
  EXPECT_EQ(parser.discarded_bytes(), 2U);
  EXPECT_EQ(parser.phase_errors(), 0U);
}

TEST(Record, AnyCutOfTheStreamGivesTheSameRecords) {
  Bytes bytes;
  for (int i = 0; i < 4; ++i) {
    bytes.insert(bytes.end(), kT05.begin(), kT05.end());
    bytes.insert(bytes.end(), kSecond.begin(), kSecond.end());
  }
  for (std::size_t cut = 1; cut < 30; ++cut) {
    RecordParser parser({RecordFormat::position_angles}, false, false);
    std::size_t count = 0;
    for (std::size_t at = 0; at < bytes.size(); at += cut) {
      count += parser.push(std::span(bytes).subspan(at, std::min(cut, bytes.size() - at))).size();
    }
    EXPECT_EQ(count, 8U) << cut;
  }
}

TEST(Record, AByteTooManyAfterARecordIsAPhaseError) {
  Bytes bytes = kT05;
  bytes.push_back(0x22);
  bytes.insert(bytes.end(), kSecond.begin(), kSecond.end());
  RecordParser parser({RecordFormat::position_angles}, false, false);
  EXPECT_EQ(parser.push(bytes).size(), 2U);
  EXPECT_EQ(parser.phase_errors(), 1U);
  EXPECT_EQ(parser.discarded_bytes(), 1U);
}

TEST(Command, BytesOfThePublishedSession) {
  EXPECT_THAT(select_format(RecordFormat::position_angles), ElementsAre(0x59));  // T13
  EXPECT_THAT(select_format(RecordFormat::position_quaternion), ElementsAre(0x5D));
  EXPECT_EQ(kPoint, 0x42);
  EXPECT_THAT(examine(kStatus), ElementsAre(0x4F, 0x00));                      // T14
  EXPECT_THAT(examine(kModel), ElementsAre(0x4F, 0x0F));                       // T19
  EXPECT_THAT(change_word(kScale, 1), ElementsAre(0x50, 0x03, 0x01, 0x00));    // T17
  EXPECT_THAT(change_word(kFilters, 7), ElementsAre(0x50, 0x04, 0x07, 0x00));  // T18
  EXPECT_THAT(set_rate_hz(100), ElementsAre(0x50, 0x07, 0x00, 0x64));          // T20
  EXPECT_THAT(set_rate_hz(138), ElementsAre(0x50, 0x07, 0x00, 0x8A));
  EXPECT_THAT(set_rate_count(100, 40), ElementsAre(0x50, 0x06, 0x5D, 0x2F));  // T21
  EXPECT_THAT(set_rate_count(103.3, 40), ElementsAre(0x50, 0x06, 0xCD, 0x2D));
  EXPECT_THAT(set_rate_count(144, 40), ElementsAre(0x50, 0x06, 0x71, 0x20));
  EXPECT_THAT(set_rate_count(100, 20), ElementsAre(0x50, 0x06, 0xAE, 0x17));
  EXPECT_THAT(set_rate_count(100, 25), ElementsAre(0x50, 0x06, 0x9A, 0x1D));
  EXPECT_THAT(select_hemisphere(Hemisphere::lower), ElementsAre(0x4C, 0x0C, 0x00));  // T22
  EXPECT_THAT(to_unit(2, select_hemisphere(Hemisphere::lower)), ElementsAre(0xF2, 0x4C, 0x0C, 0x00));
  EXPECT_THAT(to_unit(17, {kRun}), ElementsAre(0xA0, 17, 0x46));
  EXPECT_THAT(angle_align_deg(5, 10, 15), ElementsAre(0x71, 0x8E, 0x03, 0x1C, 0x07, 0xAA, 0x0A));       // T23
  EXPECT_THAT(reference_frame_deg(90, 0, -45), ElementsAre(0x72, 0x00, 0x40, 0x00, 0x00, 0x00, 0xE0));  // T24
  EXPECT_THAT(examine(kErrorCode), ElementsAre(0x4F, 0x0A));                                            // T25
  EXPECT_THAT(examine(kExpandedError), ElementsAre(0x4F, 0x10));
  EXPECT_THAT(set_group_mode(true), ElementsAre(0x50, 0x23, 0x01));  // T26
  EXPECT_THAT(auto_configure(2), ElementsAre(0x50, 0x32, 0x02));
  EXPECT_THAT(examine(kSystemStatus), ElementsAre(0x4F, 0x24));
  EXPECT_THAT(change(kVmTable, Bytes{2, 0, 6, 0, 0x1A, 0, 0x63, 0, 0x8C, 1, 0x4F, 6, 0x3C, 0x19}),  // T27
              ElementsAre(0x50, 0x0C, 2, 0, 6, 0, 0x1A, 0, 0x63, 0, 0x8C, 1, 0x4F, 6, 0x3C, 0x19));
  EXPECT_THAT(change(kLineFrequency, Bytes{50}), ElementsAre(0x50, 0x14, 0x32));           // T28
  EXPECT_EQ((Bytes{select_format(RecordFormat::position_angles)[0], 'Q', kRun, kStream}),  // T29
            (Bytes{0x59, 0x51, 0x46, 0x40}));
}

TEST(Command, RatesOfCounts) {
  EXPECT_NEAR(rate_of_count(12125, 40), 100.000, 5e-4);
  EXPECT_NEAR(rate_of_count(11725, 40), 103.306, 5e-4);
  EXPECT_NEAR(rate_of_count(8305, 40), 144.009, 5e-4);
  EXPECT_NEAR(rate_of_count(6062, 20), 100.008, 5e-4);
  EXPECT_NEAR(rate_of_count(7578, 25), 100.002, 5e-4);
}

TEST(Reply, StatusWordsOfT14) {
  const StatusWord point = decode_status_word(0xD008);
  EXPECT_TRUE(point.master && point.initialised && !point.stream && !point.asleep && !point.error);
  EXPECT_EQ(point.format_code, 4);
  EXPECT_TRUE(decode_status_word(0xD009).stream);
  const StatusWord asleep = decode_status_word(0xE030);
  EXPECT_TRUE(asleep.asleep && asleep.error && !asleep.stream);
  EXPECT_EQ(asleep.format_code, 8);
}

TEST(Reply, FlockOfT26) {
  const UnitStatus first = decode_unit_status(0xE1);
  EXPECT_TRUE(first.accessible && first.running && first.has_sensor && first.has_transmitter && !first.extended_range);
  const UnitStatus second = decode_unit_status(0xE0);
  EXPECT_TRUE(second.accessible && second.running && second.has_sensor && !second.has_transmitter);
}

TEST(Reply, ErrorTexts) {
  EXPECT_THAT(error_text(32), ::testing::HasSubstr("saturated"));
  EXPECT_THAT(error_text(13), ::testing::HasSubstr("no response"));
  EXPECT_THAT(error_text(200), ::testing::HasSubstr("200"));
}

TEST(Reply, LengthsOfExamineReplies) {
  EXPECT_EQ(examine_bytes(kStatus), 2U);
  EXPECT_EQ(examine_bytes(kModel), 10U);
  EXPECT_EQ(examine_bytes(kVmTable), 14U);
  EXPECT_EQ(examine_bytes(kAutoConfigure), 5U);
  EXPECT_EQ(examine_bytes(200), std::nullopt);
}

}  // namespace
}  // namespace birdseye::drivers::minibird
