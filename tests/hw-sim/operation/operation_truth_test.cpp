// What differs from operation to operation.
#include "hw-sim/operation/operation_truth.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

#include "hw-sim/operation/operation_laws.hpp"

namespace birdseye::hw_sim {
namespace {

OperationTruth truth_of(std::uint64_t seed) {
  OperationTruth truth(seed, 96, 72, Happenings(), false);
  truth.fit_rods(seed);
  return truth;
}

TEST(OperationTruth, EachSeedHasInstrumentsOfItsOwn) {
  constexpr std::size_t kSeeds = 20;
  std::set<std::string> scopes, cameras;
  std::set<double> tips_mm;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const OperationTruth truth = truth_of(seed), again = truth_of(seed);
    for (const std::size_t scope : {0U, 1U}) {
      scopes.insert(truth.record_of(scope).scope);
      EXPECT_EQ(calibration::record_text(truth.record_of(scope)), calibration::record_text(again.record_of(scope)));
    }
    cameras.insert(truth.record_of(0).camera.at("serial"));
    EXPECT_EQ(truth.record_of(0).camera.at("serial"), truth.camera_name());
    tips_mm.insert(truth.tip_in_pointer_mm().z());
    EXPECT_LT((truth.tip_in_pointer_mm() - Eigen::Vector3d(0, 0, 150)).norm(), 45);
    EXPECT_GT(truth.tip_in_pointer_mm().head<2>().norm(), 0);
  }
  EXPECT_EQ(scopes.size(), 2 * kSeeds);
  EXPECT_EQ(cameras.size(), kSeeds);
  EXPECT_EQ(tips_mm.size(), kSeeds);
}

/// The host's way from record and angle to hand-eye is the one that it is held against.
TEST(OperationTruth, OfSomeScopesTheRodIsTurnedAndTheRecordSaysWhereTheCameraThenIs) {
  std::size_t rods = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const OperationTruth straight(seed, 96, 72, Happenings(), false);
    const OperationTruth truth = truth_of(seed);
    for (const std::size_t scope : {0U, 1U}) {
      const calibration::CalibrationRecord& record = truth.record_of(scope);
      if (!record.hand_eye->rod) continue;
      ++rods;
      ASSERT_TRUE(truth.rod_angle_deg());
      const auto turned = host::ScopeSetup::of_record(record)->turned_to(*truth.rod_angle_deg()).camera_from_sensor();
      EXPECT_LT((turned.matrix() - truth.found_camera_from_sensor(scope).matrix()).norm(), 1e-9) << seed;
      const Transform<Camera, Sensor>& at_reference = record.hand_eye->camera_from_sensor;
      EXPECT_GT((turned.matrix() - at_reference.matrix()).norm(), 0) << seed;
    }
    if (!truth.record_of(0).hand_eye->rod) continue;
    // Off by no more than hand-eye is: the camera is where it was, and the bird goes round.
    const auto camera_from_sensor =
        truth.camera_from_patient(1) * truth.tracker_from_patient(1).inverse() * truth.tracker_from_sensor(0, 1);
    const auto off = camera_from_sensor * truth.found_camera_from_sensor(0).inverse();
    EXPECT_LT(Eigen::AngleAxisd(off.rotation()).angle(), 0.02) << seed;
    EXPECT_LT(off.translation().norm(), 2) << seed;
    EXPECT_TRUE(truth.camera_from_patient(1).matrix().isApprox(straight.camera_from_patient(1).matrix())) << seed;
  }
  EXPECT_GT(rods, 8U);
  EXPECT_LT(rods, 34U);
}

}  // namespace
}  // namespace birdseye::hw_sim
