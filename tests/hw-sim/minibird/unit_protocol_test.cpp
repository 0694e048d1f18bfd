// The unit against the protocol reference's own vectors, byte for byte, H what the host sends and U what it gets.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "calibration/base/units.hpp"
#include "hw-sim/minibird/unit.hpp"
#include "tests/hw-sim/minibird/unit_bytes.hpp"

namespace birdseye::hw_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

const Bytes kT05{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20};

BirdPose pose_of(double x_in, double y_in, double z_in, double azimuth, double elevation, double roll) {
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(azimuth * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(elevation * kRadPerDeg, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(roll * kRadPerDeg, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  return {rotation, Eigen::Vector3d(x_in, y_in, z_in) * kMmPerInch};
}

/// The poses of T05 and of the second unit in T10.
const BirdPose kFirst = pose_of(10, -5.25, 3, 45, -30, 90);
const BirdPose kSecond = pose_of(-8, 12.5, 20, -120, 15, -5);

Unit flock(int birds) {
  UnitSettings settings;
  settings.birds = birds;
  return Unit(settings);
}

Unit of_revision(std::uint8_t minor) {
  UnitSettings settings;
  settings.revision_minor = minor;
  return Unit(settings);
}

TEST(Protocol, T13PointInPositionAngles) {
  Unit unit({});
  EXPECT_TRUE(send(unit, {0x59, 0x42}).empty());
  EXPECT_EQ(unit.measure(std::vector{kFirst}), kT05);
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
}

TEST(Protocol, T14StatusWord) {
  Unit unit({});
  EXPECT_EQ(send(unit, {0x4F, 0x00}), (Bytes{0x08, 0xD0}));
  send(unit, {0x40});
  EXPECT_EQ(send(unit, {0x4F, 0x00}), (Bytes{0x09, 0xD0}));
  Unit asleep({});
  send(asleep, {0x5D, 0x47, 0x01});  // position/quaternion, sleep, no command
  EXPECT_EQ(send(asleep, {0x4F, 0x00}), (Bytes{0x30, 0xE0}));
}

TEST(Protocol, T15ToT19ConstantsScaleAndFilters) {
  Unit unit({});
  EXPECT_EQ(send(unit, {0x4F, 0x01}), (Bytes{0x03, 0x43}));
  EXPECT_EQ(send(unit, {0x4F, 0x02}), (Bytes{0x28, 0x00}));
  EXPECT_EQ(send(unit, {0x4F, 0x03}), (Bytes{0x00, 0x00}));
  send(unit, {0x50, 0x03, 0x01, 0x00, 0x56, 0x42});
  EXPECT_EQ(unit.measure(std::vector{kFirst}), (Bytes{0xF1, 0x08, 0x2A, 0x7B, 0x55, 0x02}));  // T03
  EXPECT_EQ(send(unit, {0x4F, 0x04}), (Bytes{0x04, 0x00}));
  send(unit, {0x50, 0x04, 0x07, 0x00});
  EXPECT_EQ(send(unit, {0x4F, 0x04}), (Bytes{0x07, 0x00}));
  EXPECT_EQ(send(unit, {0x4F, 0x0F}), (Bytes{0x36, 0x44, 0x46, 0x4F, 0x42, 0x20, 0x20, 0x20, 0x20, 0x20}));
}

TEST(Protocol, T20AndT21Rate) {
  Unit unit({});
  EXPECT_EQ(send(unit, {0x4F, 0x07}), (Bytes{0x4C, 0x67}));
  send(unit, {0x50, 0x07, 0x00, 0x64});
  EXPECT_DOUBLE_EQ(unit.rate_hz(), 100);
  send(unit, {0x50, 0x07, 0x00, 0x8A});
  EXPECT_DOUBLE_EQ(unit.rate_hz(), 138);
  send(unit, {0x50, 0x06, 0x5D, 0x2F});
  EXPECT_NEAR(unit.rate_hz(), 100.000, 0.0005);
  send(unit, {0x50, 0x06, 0xCD, 0x2D});
  EXPECT_NEAR(unit.rate_hz(), 103.306, 0.0005);
  send(unit, {0x50, 0x06, 0x71, 0x20});
  EXPECT_NEAR(unit.rate_hz(), 144.0, 0.01);
  UnitSettings slow;
  slow.crystal_mhz = 20;
  Unit of_20_mhz(slow);
  send(of_20_mhz, {0x50, 0x06, 0xAE, 0x17});
  EXPECT_NEAR(of_20_mhz.rate_hz(), 100.008, 0.0005);
}

TEST(Protocol, T22HemispherePerUnit) {
  Unit unit = flock(2);
  send(unit, {0x4C, 0x0C, 0x00});
  EXPECT_EQ(send(unit, {0x4F, 0x16}), (Bytes{0x0C, 0x00}));
  EXPECT_EQ(send(unit, {0xF2, 0x4F, 0x16}), (Bytes{0x00, 0x00}));
  send(unit, {0xF2, 0x4C, 0x0C, 0x00});
  EXPECT_EQ(send(unit, {0xF2, 0x4F, 0x16}), (Bytes{0x0C, 0x00}));
}

TEST(Protocol, T23AngleAlignMakesAMismountedSensorReadZero) {
  for (const Bytes& align : {Bytes{0x71, 0x8E, 0x03, 0x1C, 0x07, 0xAA, 0x0A},
                             Bytes{0x4A, 0x27, 0x0B, 0x83, 0x7F, 0x3A, 0x16, 0x0E, 0x7E, 0x20, 0x21, 0xA3, 0x7B}}) {
    Unit unit({});
    send(unit, align);
    send(unit, {0x57, 0x42});
    const Bytes record = unit.measure(std::vector{pose_of(10, 0, 0, 5, 10, 15)});
    ASSERT_EQ(record.size(), 6U);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(signed_word_at(record, i), 0, 8) << i;
  }
}

TEST(Protocol, T24ReferenceFrameTurnsTheAxesAndPositionsOnlyWhenTold) {
  for (const Bytes& reference : {Bytes{0x72, 0x00, 0x40, 0x00, 0x00, 0x00, 0xE0},
                                 Bytes{0x48, 0xFF, 0x7F, 0x00, 0x00, 0x00, 0x00, 0xFF, 0x7F, 0x7E, 0xA5, 0x82, 0x5A}}) {
    Unit unit({});
    send(unit, reference);
    send(unit, {0x59, 0x42});
    // A sensor turned as the new axes are reads zero in them; its position is still told in the transmitter's.
    const BirdPose pose = pose_of(9, 0, 0, 90, 0, -45);
    const Bytes record = unit.measure(std::vector{pose});
    EXPECT_EQ(signed_word_at(record, 0), 8192);
    for (std::size_t i = 1; i < 6; ++i) EXPECT_NEAR(signed_word_at(record, i), 0, 8) << i;
    send(unit, {0x50, 0x11, 0x01, 0x42});
    const Bytes turned = unit.measure(std::vector{pose});
    // Transmitter x in the new axes: Rx(-45)^T Rz(90)^T (1, 0, 0) = Rx(45) (0, -1, 0) = (0, -0.7071, -0.7071).
    EXPECT_NEAR(signed_word_at(turned, 0), 0, 8);
    EXPECT_NEAR(signed_word_at(turned, 1), -5793, 8);
    EXPECT_NEAR(signed_word_at(turned, 2), -5793, 8);
  }
}

TEST(Protocol, T25ErrorsAreReadOnceInTheirOrder) {
  Unit unit({});
  unit.latch_error(32);
  EXPECT_EQ(send(unit, {0x4F, 0x0A}), (Bytes{0x20}));
  EXPECT_EQ(send(unit, {0x4F, 0x0A}), (Bytes{0x00}));
  Unit two = flock(2);
  send(two, {0xF3, 0x59});  // there is no unit 3
  EXPECT_EQ(send(two, {0x4F, 0x10}), (Bytes{0x0D, 0x03}));
  EXPECT_EQ(send(two, {0x4F, 0x10}), (Bytes{0x00, 0x00}));
}

TEST(Protocol, T26GroupModeAndT10Records) {
  Unit unit = flock(2);
  EXPECT_EQ(send(unit, {0x4F, 0x32}), (Bytes{0, 0, 0, 0, 0}));
  send(unit, {0x50, 0x32, 0x02});
  EXPECT_EQ(send(unit, {0x4F, 0x24}), (Bytes{0xE1, 0xE0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(send(unit, {0x4F, 0x32}), (Bytes{0x01, 0x06, 0x00, 0x04, 0x00}));
  // The second sensor is at -8 in: it needs the hemisphere aft.
  send(unit, {0x50, 0x23, 0x01, 0x4D, 0x01, 0xF2, 0x4D, 0x01, 0xF2, 0x4C, 0x00, 0x01});
  unit.press(0, 0x10);
  send(unit, {0x42});
  Bytes expected = kT05;
  for (const int byte :
       {0x10, 0x01, 0xE3, 0x71, 0x1C, 0x16, 0x47, 0x23, 0x2A, 0x55, 0x2A, 0x05, 0x1C, 0x7E, 0x00, 0x02})
    expected.push_back(static_cast<std::uint8_t>(byte));
  EXPECT_EQ(unit.measure(std::vector{kFirst, kSecond}), expected);
  EXPECT_EQ(send(unit, {0x4E}), (Bytes{0x10}));
  Unit alone({});
  EXPECT_EQ(send(alone, {0x4F, 0x32}), (Bytes{0, 0, 0, 0, 0}));
}

TEST(Protocol, T27AndT28TablesAreStored) {
  Unit unit({});
  const Bytes table{0x02, 0x00, 0x06, 0x00, 0x1A, 0x00, 0x63, 0x00, 0x8C, 0x01, 0x4F, 0x06, 0x3C, 0x19};
  EXPECT_EQ(send(unit, {0x4F, 0x0C}), table);
  Bytes other = table;
  other.front() = 0x07;
  Bytes command{0x50, 0x0C};
  command.insert(command.end(), other.begin(), other.end());
  send(unit, command);
  EXPECT_EQ(send(unit, {0x4F, 0x0C}), other);
  EXPECT_EQ(send(unit, {0x4F, 0x14}), (Bytes{0x3C}));
  send(unit, {0x50, 0x14, 0x32});
  EXPECT_EQ(send(unit, {0x4F, 0x14}), (Bytes{0x32}));
}

TEST(Protocol, T29StreamSession) {
  Unit unit({});
  send(unit, {0x59, 0x51, 0x46, 0x40});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(unit.measure(std::vector{kFirst}), kT05);
  send(unit, {0x42});
  EXPECT_EQ(unit.measure(std::vector{kFirst}), kT05);
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
  send(unit, {0x40, 0x3F});  // stream, stop: no further record
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
}

TEST(Unit, EveryParameterThatCanBeSetIsReadBackInItsLength) {
  struct Row {
    std::uint8_t number;
    std::size_t bytes;
  };
  // The lengths of section 9, apart from those parameters that mean more than to be stored.
  for (const Row& row : {Row{3, 2},
                         {4, 2},
                         {5, 14},
                         {8, 1},
                         {9, 1},
                         {11, 1},
                         {12, 14},
                         {13, 14},
                         {14, 1},
                         {17, 1},
                         {18, 1},
                         {20, 1},
                         {21, 1},
                         {22, 2},
                         {23, 6},
                         {24, 6},
                         {32, 2},
                         {33, 5}}) {
    Unit unit({});
    Bytes command{0x50, row.number}, value(row.bytes, 0x01);
    command.insert(command.end(), value.begin(), value.end());
    EXPECT_TRUE(send(unit, command).empty());
    EXPECT_EQ(send(unit, {0x4F, row.number}), value) << int{row.number};
    EXPECT_EQ(send(unit, {0x4F, 0x0A}), (Bytes{0})) << int{row.number};
    unit.reset();
    EXPECT_NE(send(unit, {0x4F, row.number}), value) << int{row.number};
  }
}

TEST(Unit, OlderFirmwareDoesNotKnowNewerParameters) {
  struct Row {
    std::uint8_t number, first;
  };
  for (const Row& row : {Row{7, 64}, {17, 45}, {18, 66}, {20, 67}, {22, 67}, {25, 67}, {26, 71}, {35, 33}}) {
    Unit before = of_revision(static_cast<std::uint8_t>(row.first - 1));
    EXPECT_TRUE(send(before, {0x4F, row.number}).empty());
    EXPECT_EQ(send(before, {0x4F, 0x0A}), (Bytes{6})) << int{row.number};
    Unit since = of_revision(row.first);
    EXPECT_FALSE(send(since, {0x4F, row.number}).empty()) << int{row.number};
  }
}

TEST(Unit, ReportRateAndSleepThinTheStream) {
  Unit unit({});
  send(unit, {0x52, 0x40});  // every second cycle
  int records = 0;
  for (int i = 0; i < 16; ++i) records += unit.measure(std::vector{kFirst}).empty() ? 0 : 1;
  EXPECT_EQ(records, 8);
  send(unit, {0x47});
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
  send(unit, {0x51, 0x46});
  EXPECT_FALSE(unit.measure(std::vector{kFirst}).empty());
}

TEST(Unit, DataReadyTellsEachMeasurementAndPointFetchesIt) {
  Unit unit({});
  send(unit, {0x50, 0x08, 0x01});
  EXPECT_EQ(unit.measure(std::vector{kFirst}), (Bytes{0x2C}));
  send(unit, {0x50, 0x09, 0x2E, 0x42});
  Bytes expected = kT05;
  expected.push_back(0x2E);
  EXPECT_EQ(unit.measure(std::vector{kFirst}), expected);
}

TEST(Unit, XoffHoldsRecordsAndRepliesBackUntilXon) {
  Unit unit({});
  send(unit, {0x40, 0x13});
  EXPECT_TRUE(unit.measure(std::vector{kFirst}).empty());
  EXPECT_TRUE(send(unit, {0x4F, 0x00}).empty());
  const Bytes status = send(unit, {0x11});
  ASSERT_EQ(status.size(), 2U);
  EXPECT_EQ(status[0] & 0x40, 0x40);  // it was in effect when it was asked for
  EXPECT_FALSE(unit.measure(std::vector{kFirst}).empty());
}

TEST(Unit, SyncRepliesFourBytesAndOnlyToFF) {
  Unit unit({});
  EXPECT_TRUE(send(unit, {0x41, 0x00}).empty());
  EXPECT_EQ(send(unit, {0x41, 0xFF}).size(), 4U);
}

TEST(Unit, OnlyTheMasterTakesGroupModeAndConfiguration) {
  Unit unit = flock(2);
  send(unit, {0xF2, 0x50, 0x23, 0x01});
  EXPECT_EQ(send(unit, {0xF2, 0x4F, 0x0A}), (Bytes{7}));
  send(unit, {0x50, 0x32, 0x03});  // a unit more than there is
  EXPECT_EQ(send(unit, {0x4F, 0x10}), (Bytes{13, 3}));
  send(unit, {0xF2, 0x42});  // not configured: it does not run
  EXPECT_TRUE(unit.measure(std::vector{kFirst, kSecond}).empty());
  EXPECT_EQ(send(unit, {0xF2, 0x4F, 0x0A}), (Bytes{9}));
}

TEST(Unit, LargeFlocksAreAddressedInTheirOwnWays) {
  Unit expanded = flock(20);
  EXPECT_EQ(send(expanded, {0xE2, 0x4F, 0x15}), (Bytes{18}));
  EXPECT_EQ(send(expanded, {0x4F, 0x24}).size(), 30U);
  EXPECT_EQ(send(expanded, {0x4F, 0x32}).size(), 7U);
  Unit super = flock(40);
  EXPECT_EQ(send(super, {0xA0, 40, 0x4F, 0x15}), (Bytes{40}));
  EXPECT_EQ(send(super, {0x4F, 0x24}).size(), 126U);
  EXPECT_EQ(send(super, {0x4F, 0x32}).size(), 19U);
}

TEST(Unit, ExamineWhileStreamingIsCountedAgainstTheHost) {
  Unit unit({});
  send(unit, {0x4F, 0x00});
  EXPECT_EQ(unit.violations(), 0);
  send(unit, {0x40, 0x4F, 0x00});
  EXPECT_EQ(unit.violations(), 1);
}

}  // namespace
}  // namespace birdseye::hw_sim
