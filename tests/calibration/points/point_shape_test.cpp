#include "calibration/points/point_shape.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "tests/support/data.hpp"
#include "tests/support/points_file.hpp"

namespace birdseye::calibration {
namespace {

using Shapes = std::vector<Eigen::Vector3d>;

/// Touched to so many mm an axis; `change` is what a wrong file does to a point of the CT.
struct Sets {
  Shapes to, from;
};
template <typename Change>
Sets sets_of(const Shapes& ct, double noise_mm, unsigned seed, const Change& change) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  const Transform<Tracker, Patient> move(rotation_exp(Eigen::Vector3d(0.4, -1.1, 2)), Eigen::Vector3d(5, -300, 70));
  Sets out;
  for (const Eigen::Vector3d& p : ct) {
    out.to.push_back(change(p));
    out.from.push_back(move * p + Eigen::Vector3d(noise(random), noise(random), noise(random)));
  }
  return out;
}

const Shapes kRound{{0, 0, 0}, {120, 10, 5}, {15, 140, -10}, {130, 150, 30}, {60, 70, 90}, {-20, 60, 45}};
const Shapes kFlat{{0, 0, 0}, {120, 10, 0.2}, {15, 140, -0.2}, {130, 150, 0.3}, {60, 70, 0}};

TEST(PointShape, SoundSetsAreOfOneHandednessAndSize) {
  int alarms = 0, axis_alarms = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Sets sets = sets_of(kRound, 0.7, seed, [](const Eigen::Vector3d& p) { return p; });
    const PointShape shape = compare_shapes(sets.to, sets.from);
    EXPECT_EQ(shape.handedness, Handedness::same);
    EXPECT_NEAR(shape.scale, 1, 0.03);
    alarms += shape.scale_chance < 0.01 ? 1 : 0;
    axis_alarms += shape.axis_scale_chance < 0.01 ? 1 : 0;
    EXPECT_EQ(compare_shapes(sets.to, sets.from, 1.2).handedness, Handedness::same);
  }
  // 2 of 200 by chance, fewer by what sound instruments may differ by; 8 would be by chance in under 1 of 1000 runs.
  EXPECT_LT(alarms, 8);
  EXPECT_LT(axis_alarms, 8);
}

TEST(PointShape, AMirrorImageIsTold) {
  const Sets sets =
      sets_of(kRound, 0.7, 1, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.x(), p.y(), -p.z()); });
  for (const auto& localisation_mm : {std::optional<double>(), std::optional<double>(1.2)}) {
    const PointShape shape = compare_shapes(sets.to, sets.from, localisation_mm);
    EXPECT_EQ(shape.handedness, Handedness::mirrored);
    EXPECT_LT(shape.mirrored_fre_rms_mm, 3);
    EXPECT_GT(shape.fre_rms_mm, 10);
  }
  // Two signs are a turn, not a mirror image: RAS for LPS.
  const Sets turned =
      sets_of(kRound, 0.7, 1, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(-p.x(), -p.y(), p.z()); });
  EXPECT_EQ(compare_shapes(turned.to, turned.from).handedness, Handedness::same);
}

TEST(PointShape, OfFlatSetsAMirrorImageCannotBeTold) {
  const Sets flat = sets_of(kFlat, 0.7, 2, [](const Eigen::Vector3d& p) { return p; });
  EXPECT_EQ(compare_shapes(flat.to, flat.from).handedness, Handedness::cannot_tell);
  const Shapes three(kRound.begin(), kRound.begin() + 3);
  const Sets exact = sets_of(three, 0, 2, [](const Eigen::Vector3d& p) { return p; });
  EXPECT_EQ(compare_shapes(exact.to, exact.from).handedness, Handedness::cannot_tell);
}

TEST(PointShape, AScaleIsToldByItsOwnError) {
  const auto larger = [](const Eigen::Vector3d& p) { return Eigen::Vector3d(1.05 * p); };
  const Sets sets = sets_of(kRound, 0.7, 3, larger);
  const PointShape shape = compare_shapes(sets.to, sets.from);
  EXPECT_NEAR(shape.scale, 1.05, 3 * shape.scale_sigma);
  EXPECT_LT(shape.scale_chance, 0.001);
  // Touched ten times worse, the same scale may be chance.
  const Sets blurred = sets_of(kRound, 7, 3, larger);
  EXPECT_GT(compare_shapes(blurred.to, blurred.from).scale_chance, 0.01);
  // What a sound CT and a sound tracker differ by is no fault, however well the markers are touched.
  const Sets sound = sets_of(kRound, 0, 3, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(1.003 * p); });
  EXPECT_GT(compare_shapes(sound.to, sound.from).scale_chance, 0.05);
}

TEST(PointShape, PelvisPhantomIsOfOneHandednessThoughItsMarkersAreFlat) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "fiducial_registration_pelvis_phantom";
  const Shapes ct = testing::read_points(folder / "pelvis_cropped_ct_fiducial_markers.txt");
  const PointShape shape = compare_shapes(ct, testing::read_points(folder / "Tracker_Fiducial_Markers.txt"));
  EXPECT_EQ(shape.handedness, Handedness::same) << shape.mirrored_odds;
  EXPECT_GT(shape.scale_chance, 0.01) << shape.scale;
}

}  // namespace
}  // namespace birdseye::calibration
