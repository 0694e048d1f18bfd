// The figures of two recordings of fiducials on real phantoms.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "calibration/points/odd_points.hpp"
#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"
#include "tests/support/data.hpp"

namespace birdseye::calibration {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Phantom = Patient;  ///< the frame of its drawing

/// A recording by PLUS: poses by frame, in the header of a MetaImage.
struct Recording {
  std::vector<Transform<Tracker, Marker>> tracker_from_reference;
  std::vector<Transform<Tracker, Pointer>> tracker_from_stylus;
  [[nodiscard]] Transform<Marker, Pointer> reference_from_stylus(std::size_t frame) const {
    return tracker_from_reference[frame].inverse() * tracker_from_stylus[frame];
  }
};

Recording read_recording(const std::filesystem::path& path) {
  std::ifstream in(path);
  Recording out;
  std::string line;
  while (std::getline(in, line)) {
    const auto equals = line.find(" = ");
    if (equals == std::string::npos) continue;
    std::istringstream numbers(line.substr(equals + 3));
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) numbers >> m(i / 4, i % 4);
    if (line.find("_ReferenceToTrackerTransform =") != std::string::npos)
      out.tracker_from_reference.push_back(Transform<Tracker, Marker>::from_matrix(m));
    if (line.find("_StylusToTrackerTransform =") != std::string::npos)
      out.tracker_from_stylus.push_back(Transform<Tracker, Pointer>::from_matrix(m));
  }
  return out;
}

/// First frame of each, and the one after the last. Published as approximate: medians move by kPhaseEnds_mm with the
/// ends.
constexpr double kPhaseEnds_mm = 0.025;
constexpr std::size_t kPhases[8][2] = {{77, 163},  {172, 254}, {275, 353}, {361, 457},
                                       {530, 613}, {624, 716}, {725, 820}, {831, 930}};
const Points kLandmarks{{104.3, 5, 20},  {104.3, 45, 20}, {104.3, 45, 0}, {104.3, -5, 0},
                        {-34.3, 45, 15}, {-34.3, -5, 20}, {-34.3, -5, 0}, {-34.3, 45, 0}};

/// The tip's median place in each phase, in the frame of the reference.
Points touches(const Recording& recording, const Eigen::Vector3d& tip_in_stylus_mm) {
  Points out;
  for (const auto& [first, last] : kPhases) {
    Eigen::Vector3d median;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t frame = first; frame < last; ++frame)
        values.push_back((recording.reference_from_stylus(frame) * tip_in_stylus_mm)[axis]);
      std::sort(values.begin(), values.end());
      median[axis] = 0.5 * (values[values.size() / 2] + values[(values.size() - 1) / 2]);
    }
    out.push_back(median);
  }
  return out;
}

class EightLandmarks : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto data = birdseye::testing::data_dir();
    if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
    recording =
        read_recording(*data / "em_tracker_sequences" / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha");
    ASSERT_EQ(recording.tracker_from_stylus.size(), 1000U);
    ASSERT_EQ(recording.tracker_from_reference.size(), 1000U);
  }
  Recording recording;
};

TEST_F(EightLandmarks, PositionsAreThoseOfA36InchBird) {
  for (const auto& pose : recording.tracker_from_stylus) {
    const Eigen::Vector3d counts = pose.translation() * 32768 / 914.4;
    EXPECT_LT((counts - counts.array().round().matrix()).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST_F(EightLandmarks, AreFittedAsThePeerDid) {
  const Points touched = touches(recording, {108.565, 7.77385, 2.5389});
  const auto fit = fit_points<Marker, Phantom>(touched, kLandmarks);
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_NEAR(fit->fre_rms_mm, 0.37, kPhaseEnds_mm);
  EXPECT_LT((fit->to_from.translation() - Eigen::Vector3d(22.66, -39.75, 25.52)).cwiseAbs().maxCoeff(), kPhaseEnds_mm);
  // The peer took other frames: its answer lies within what FRE and geometry allow, at the landmarks and between them.
  Eigen::Matrix3d rotation;
  rotation << -0.00479115, 0.00329566, -0.999983, -0.0127965, 0.999912, 0.00335674, 0.999907, 0.0128124, -0.00474856;
  const Transform<Marker, Phantom> peer(rotation, Eigen::Vector3d(22.7064, -39.7536, 25.6504));
  const TargetError predicted(kLandmarks, localisation_error_of(fit->fre_rms_mm, 8).rms_mm);
  EXPECT_LT((fit->to_from.translation() - peer.translation()).norm(), 0.15);
  EXPECT_LT(rotation_angle_between(fit->to_from.rotation(), peer.rotation()), 0.002);
  for (const Eigen::Vector3d& landmark : kLandmarks) {
    EXPECT_LT((fit->to_from * landmark - peer * landmark).norm(), 2 * predicted.rms_mm(landmark));
  }
  EXPECT_EQ(find_odd_points(touched, kLandmarks).verdict, OddPointsVerdict::none);
}

TEST_F(EightLandmarks, ATipThatIsAMillimetreOffRaisesFreMuchMoreThanItsOwnRms) {
  // All phases share the tip: reference_from_stylus * tip = pivot of the phase, linear in the tip and eight pivots.
  std::size_t frames = 0;
  for (const auto& [first, last] : kPhases) frames += last - first;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * frames), 27);
  Eigen::VectorXd b(static_cast<Eigen::Index>(3 * frames));
  Eigen::Index row = 0;
  Eigen::Index phase = 0;
  for (const auto& [first, last] : kPhases) {
    for (std::size_t frame = first; frame < last; ++frame, row += 3) {
      const auto pose = recording.reference_from_stylus(frame);
      a.block<3, 3>(row, 0) = pose.rotation();
      a.block<3, 3>(row, 3 + 3 * phase) = -Eigen::Matrix3d::Identity();
      b.segment<3>(row) = -pose.translation();
    }
    ++phase;
  }
  const Eigen::VectorXd solved = a.householderQr().solve(b);
  const Eigen::Vector3d tip = solved.head<3>();
  EXPECT_LT((tip - Eigen::Vector3d(109.62, 6.56, 2.78)).cwiseAbs().maxCoeff(), 0.006) << tip.transpose();
  const double component_rms_mm = std::sqrt((a * solved - b).squaredNorm() / static_cast<double>(3 * frames));
  EXPECT_NEAR(component_rms_mm, 0.318, 5e-4);
  EXPECT_NEAR(std::sqrt(3.0) * component_rms_mm, 0.551, 1e-3);
  const auto fit = fit_points<Marker, Phantom>(touches(recording, tip), kLandmarks);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->fre_rms_mm, 1.23, kPhaseEnds_mm);
}

}  // namespace
}  // namespace birdseye::calibration
