#include "hw-sim/minibird/unit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "calibration/base/units.hpp"
#include "calibration/geometry/transform.hpp"
#include "tests/hw-sim/minibird/unit_bytes.hpp"

namespace birdseye::hw_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// R = Rz(azimuth) Ry(elevation) Rx(roll), degrees.
Eigen::Matrix3d pose_of_angles(double azimuth, double elevation, double roll) {
  return (Eigen::AngleAxisd(azimuth * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(elevation * kRadPerDeg, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll * kRadPerDeg, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

// The published vectors of the wire format: pose in, bytes out.
TEST(RecordEncoder, PositionAndAnglesAsPublished) {
  const BirdPose pose{pose_of_angles(45, -30, 90), Eigen::Vector3d(10, -5.25, 3) * kMmPerInch};
  const double full = 36 * kMmPerInch;
  EXPECT_EQ(phased_bytes(record_words(OutputFormat::position, pose, full)),
            (Bytes{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05}));
  EXPECT_EQ(phased_bytes(record_words(OutputFormat::position, pose, 2 * full)),
            (Bytes{0xF1, 0x08, 0x2A, 0x7B, 0x55, 0x02}));
  EXPECT_EQ(phased_bytes(record_words(OutputFormat::angles, pose, full)), (Bytes{0x80, 0x10, 0x2A, 0x75, 0x00, 0x20}));
}

TEST(RecordEncoder, MatrixAndQuaternionAsPublished) {
  const BirdPose pose{pose_of_angles(30, 20, 10), Eigen::Vector3d::Zero()};
  EXPECT_EQ(phased_bytes(record_words(OutputFormat::matrix, pose, 1)),
            (Bytes{0x8A, 0x34, 0x63, 0x63, 0x1C, 0x18, 0x09, 0x1E, 0x3E, 0x38, 0x13, 0x01, 0x0E, 0x6A, 0x38, 0x0A, 0x1D,
                   0x3B}));
  EXPECT_EQ(phased_bytes(record_words(OutputFormat::quaternion, pose, 1)),
            (Bytes{0xF3, 0x3C, 0x47, 0x7D, 0x71, 0x73, 0x57, 0x70}));
}

TEST(RecordEncoder, SaturatesAtFullScale) {
  const BirdPose far{Eigen::Matrix3d::Identity(), Eigen::Vector3d(5000, -5000, 0)};
  const auto words = record_words(OutputFormat::position, far, 914.4);
  EXPECT_EQ(words[0], 32767);
  EXPECT_EQ(words[1], -32768);
}

TEST(Unit, AnswersExamineAsPublished) {
  Unit unit({});
  EXPECT_EQ(send(unit, {0x4F, 0x01}), (Bytes{3, 0x43}));
  EXPECT_EQ(send(unit, {0x4F, 0x02}), (Bytes{0x28, 0}));
  EXPECT_EQ(send(unit, {0x4F, 0x04}), (Bytes{4, 0}));
  EXPECT_EQ(send(unit, {0x4F, 0x07}), (Bytes{0x4C, 0x67}));
  const Bytes model = send(unit, {0x4F, 0x0F});
  EXPECT_EQ(std::string(model.begin(), model.end()), "6DFOB     ");
  EXPECT_EQ(send(unit, {0x50, 0x03, 0x01, 0x00, 0x4F, 0x03}), (Bytes{1, 0}));
  EXPECT_EQ(send(unit, {0x4C, 0x0C, 0x00, 0x4F, 0x16}), (Bytes{0x0C, 0}));
}

TEST(Unit, AnUnknownCommandIsSilentAndLatchesError6) {
  Unit unit({});
  EXPECT_TRUE(send(unit, {0x01}).empty());
  EXPECT_EQ(send(unit, {0x4F, 0x0A}), (Bytes{6}));
  EXPECT_EQ(send(unit, {0x4F, 0x0A}), (Bytes{0}));
}

TEST(Unit, StreamsOneRecordACycleAndStopsOnPoint) {
  Unit unit({});
  const std::vector<BirdPose> poses(1);
  EXPECT_TRUE(unit.measure(poses).empty());
  send(unit, {'Z', '@'});
  EXPECT_EQ(unit.measure(poses).size(), 24U);
  send(unit, {'B'});
  EXPECT_EQ(unit.measure(poses).size(), 24U);
  EXPECT_TRUE(unit.measure(poses).empty());
}

TEST(Unit, AFlockInGroupModeEndsEachRecordWithItsAddress) {
  UnitSettings settings;
  settings.birds = 2;
  Unit unit(settings);
  send(unit, {0x50, 0x32, 2, 0xF1, 'Z', 0xF2, 'Y', 0x50, 0x23, 1, 'F', '@'});
  const Bytes out = unit.measure(std::vector<BirdPose>(2));
  ASSERT_EQ(out.size(), 25U + 13U);
  EXPECT_EQ(out[24], 1);
  EXPECT_EQ(out[37], 2);
  EXPECT_EQ(out[0] & 0x80, 0x80);
  EXPECT_EQ(out[25] & 0x80, 0x80);
  EXPECT_EQ(send(unit, {0x4F, 0x32}), (Bytes{1, 6, 0, 4, 0}));
}

TEST(Unit, OutsideItsHemisphereItReportsTheMirroredPosition) {
  Unit unit({});
  send(unit, {'V', 'B'});
  const BirdPose behind{Eigen::Matrix3d::Identity(), Eigen::Vector3d(-100, 20, 30)};
  const BirdPose mirrored{Eigen::Matrix3d::Identity(), Eigen::Vector3d(100, -20, -30)};
  EXPECT_EQ(unit.measure(std::vector{behind}), phased_bytes(record_words(OutputFormat::position, mirrored, 914.4)));
}

}  // namespace
}  // namespace birdseye::hw_sim
