// Two recordings of pivots whose answers are published.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "calibration/points/pivot_verdict.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/files/pose_files.hpp"
#include "tests/support/data.hpp"

namespace birdseye::calibration {
namespace {

using Phantom = Patient;    ///< the frame of its drawing
using Reference = Tracker;  ///< what read_pose_set puts in the tracker's place

TEST(RecordedPivot, TheOpticalPointerHasItsPublishedTip) {
  const auto data = birdseye::testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto set = host::read_pose_set(*data / "pivot_optical_pointer");
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 57U);
  std::vector<PivotPose> poses;
  for (const auto& pose : set->poses) poses.push_back({pose.tracker_from_sensor, 0, pose.time_s});
  const auto solved = solve_pivot(poses);
  ASSERT_TRUE(solved) << solved.error().what;
  const PivotFit& all = solved->algebraic;
  constexpr double kDigits = 0.0006;
  EXPECT_LT((all.tip_in_sensor_mm - Eigen::Vector3d(-14.473, 394.634, -7.407)).cwiseAbs().maxCoeff(), kDigits);
  EXPECT_LT((all.pivots_in_tracker_mm[0] - Eigen::Vector3d(-804.742, -85.474, -2112.131)).cwiseAbs().maxCoeff(),
            kDigits);
  EXPECT_NEAR(all.component_rms_mm, 1.761, kDigits);
  EXPECT_NEAR(all.rms_mm, 3.050, kDigits);
  EXPECT_LT(solved->robust.component_rms_mm, 0.9 * all.component_rms_mm);
  EXPECT_GE(solved->outliers.size(), 1U);
  EXPECT_LE(solved->outliers.size(), 10U);
  std::cout << "[ figures  ] without " << solved->outliers.size() << " outliers: " << solved->robust.component_rms_mm
            << " mm a component, tip " << solved->robust.tip_in_sensor_mm.transpose() << " sigma "
            << solved->tip_sigma_mm << " held out " << solved->held_out_mm << " tilt " << solved->tilt.widest_deg
            << " weakest " << solved->tilt.weakest_swing_deg << " slid " << solved->slid_mm << "\n";
}

/// Of the two halves of a recording by time: the tips' distance against what both state, squared; below it is 99 % of a
/// chi-square of three.
constexpr double kWithin99 = 11.34;
void expect_halves_agree(const std::vector<PivotPose>& poses, bool by_divot) {
  std::array<std::vector<PivotPose>, 2> halves;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    PivotPose pose = poses[i];
    const bool second = by_divot ? pose.divot >= 4 : i >= poses.size() / 2;
    if (by_divot) pose.divot %= 4;
    halves.at(second ? 1 : 0).push_back(pose);
  }
  const auto one = solve_pivot(halves[0]), other = solve_pivot(halves[1]);
  ASSERT_TRUE(one && other);
  const Eigen::Vector3d off_mm = one->robust.tip_in_sensor_mm - other->robust.tip_in_sensor_mm;
  const double squared = off_mm.dot((one->tip_covariance_mm2 + other->tip_covariance_mm2).inverse() * off_mm);
  EXPECT_LT(squared, kWithin99);
  std::cout << "[ figures  ] halves: tips " << off_mm.norm() << " mm apart, distance squared " << squared << ", sigmas "
            << one->tip_sigma_mm << " and " << other->tip_sigma_mm << " mm\n";
}

TEST(RecordedPivot, HalvesOfTheOpticalPointersPosesAgree) {
  const auto data = birdseye::testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto set = host::read_pose_set(*data / "pivot_optical_pointer");
  ASSERT_TRUE(set) << set.error().what;
  std::vector<PivotPose> poses;
  for (const auto& pose : set->poses) poses.push_back({pose.tracker_from_sensor, 0, pose.time_s});
  expect_halves_agree(poses, false);
}

/// First frame of each, and the one after the last. Published as approximate: medians move by kPhaseEnds_mm with the
/// ends.
constexpr double kPhaseEnds_mm = 0.025;
constexpr std::size_t kPhases[8][2] = {{77, 163},  {172, 254}, {275, 353}, {361, 457},
                                       {530, 613}, {624, 716}, {725, 820}, {831, 930}};
const std::vector<Eigen::Vector3d> kLandmarks{{104.3, 5, 20},  {104.3, 45, 20}, {104.3, 45, 0}, {104.3, -5, 0},
                                              {-34.3, 45, 15}, {-34.3, -5, 20}, {-34.3, -5, 0}, {-34.3, 45, 0}};

class EightDivots : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto data = birdseye::testing::data_dir();
    if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
    const auto set =
        host::read_pose_set(*data / "em_tracker_sequences/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha",
                            {"StylusToTracker", "ReferenceToTracker"});
    ASSERT_TRUE(set) << set.error().what;
    ASSERT_EQ(set->poses.size(), 1000U);
    for (const auto& pose : set->poses) {
      for (std::size_t k = 0; k < 8; ++k) {
        if (pose.index >= kPhases[k][0] && pose.index < kPhases[k][1])
          poses.push_back({pose.tracker_from_sensor, k, pose.time_s});
      }
    }
  }
  /// The tip's median place in each divot, in the frame of the reference.
  [[nodiscard]] std::vector<Eigen::Vector3d> touches(const Eigen::Vector3d& tip_in_stylus_mm) const {
    std::vector<Eigen::Vector3d> out;
    for (std::size_t k = 0; k < 8; ++k) {
      std::array<std::vector<double>, 3> values;
      for (const PivotPose& pose : poses) {
        const Eigen::Vector3d place = pose.tracker_from_sensor * tip_in_stylus_mm;
        for (int axis = 0; pose.divot == k && axis < 3; ++axis)
          values[static_cast<std::size_t>(axis)].push_back(place[axis]);
      }
      out.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        auto& v = values[static_cast<std::size_t>(axis)];
        std::sort(v.begin(), v.end());
        out.back()[axis] = 0.5 * (v[v.size() / 2] + v[(v.size() - 1) / 2]);
      }
    }
    return out;
  }
  std::vector<PivotPose> poses;
};

TEST_F(EightDivots, FourAndFourAgree) {
  expect_halves_agree(poses, true);
}

TEST_F(EightDivots, GiveTheTipThatIsPublished) {
  const auto solved = solve_pivot(poses);
  ASSERT_TRUE(solved) << solved.error().what;
  const PivotFit& joint = solved->algebraic;
  EXPECT_LT((joint.tip_in_sensor_mm - Eigen::Vector3d(109.62, 6.56, 2.78)).cwiseAbs().maxCoeff(), 0.006)
      << joint.tip_in_sensor_mm.transpose();
  EXPECT_NEAR(joint.component_rms_mm, 0.318, 5e-4);
  EXPECT_NEAR(joint.rms_mm, 0.551, 1e-3);
  EXPECT_LT(solved->robust.component_rms_mm, joint.component_rms_mm);
  const Verdict verdict = judge_pivot(*solved);
  std::cout << "[ figures  ] robust tip " << solved->robust.tip_in_sensor_mm.transpose() << " component rms "
            << solved->robust.component_rms_mm << " outliers " << solved->outliers.size() << " of " << poses.size()
            << " sigma " << solved->tip_sigma_mm << " held out " << solved->held_out_mm << " slid " << solved->slid_mm
            << " +- " << solved->slid_sigma_mm << " tilt " << solved->tilt.widest_deg << " weakest "
            << solved->tilt.weakest_swing_deg << "; " << name_of(verdict.grade) << "\n";
  for (const auto& reason : verdict.reasons) std::cout << "  " << reason << "\n";
  // With that tip the landmarks fit worse than with the peer's: FRE tells more than the pivot's residual does.
  const auto fit = fit_points<Reference, Phantom>(touches(joint.tip_in_sensor_mm), kLandmarks);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->fre_rms_mm, 1.23, kPhaseEnds_mm);
}

TEST_F(EightDivots, RegisterThePhantomWithThePeersTip) {
  const auto fit = fit_points<Reference, Phantom>(touches({108.565, 7.77385, 2.5389}), kLandmarks);
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_LT((fit->to_from.translation() - Eigen::Vector3d(22.66, -39.75, 25.52)).cwiseAbs().maxCoeff(), kPhaseEnds_mm);
  EXPECT_NEAR(fit->fre_rms_mm, 0.37, kPhaseEnds_mm);
  // What the peer itself found from other frames.
  EXPECT_LT((fit->to_from.translation() - Eigen::Vector3d(22.706, -39.754, 25.650)).norm(), 0.2);
}

}  // namespace
}  // namespace birdseye::calibration
