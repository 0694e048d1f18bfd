#include "hw-sim/case/deformation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <filesystem>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using Eigen::Vector3d;

/// Half an ellipsoid of axes like a liver's, in a coarse CT: quick, and no kind of deformation fits it by chance.
Subject lump() {
  const Vector3d radii(85, 60, 50);
  const auto inside_mm = [&](const Vector3d& p) {
    return std::max(50 * (p.cwiseQuotient(radii).norm() - 1), 0.3 * p.x() - p.z() - 20);
  };
  Subject subject;
  subject.surface = closed_surface(inside_mm, {-110, -85, -75}, {110, 85, 75}, 3);
  const auto [low, high] = bounds(subject.surface);
  subject.grid = Grid::around(low - Vector3d::Constant(25), high + Vector3d::Constant(25), 4);
  for (int k = 0; k < subject.grid.size[2]; ++k) {
    for (int j = 0; j < subject.grid.size[1]; ++j) {
      for (int i = 0; i < subject.grid.size[0]; ++i)
        subject.labels.push_back(inside_mm(subject.grid.point(i, j, k)) < 0 ? 1 : 0);
    }
  }
  subject.organ_labels = {1};
  subject.towards_scope = -Vector3d::UnitY();
  return subject;
}

class EachKind : public ::testing::TestWithParam<DeformationKind> {};

std::string name(const ::testing::TestParamInfo<DeformationKind>& kind) {
  return name_of(kind.param);
}

INSTANTIATE_TEST_SUITE_P(Deformation, EachKind,
                         ::testing::Values(DeformationKind::elastic, DeformationKind::bezier, DeformationKind::bend,
                                           DeformationKind::push, DeformationKind::compression, DeformationKind::twist,
                                           DeformationKind::breathing, DeformationKind::pneumoperitoneum),
                         name);

TEST_P(EachKind, IsOneToOneAndMovesTheSurfaceByItsAmplitude) {
  const Subject subject = lump();
  for (const double amplitude_mm : {4.0, 12.0}) {
    const auto drawn = draw_deformation(subject, {.kind = GetParam(), .amplitude_mm = amplitude_mm}, 11);
    ASSERT_TRUE(drawn) << drawn.error().what;
    const TissueMap& map = *drawn->map;
    EXPECT_GT(map.least_determinant(), TissueMap::kLeastDeterminant);
    double most_mm = 0;
    for (const Eigen::Vector3f& v : subject.surface.vertices)
      most_mm = std::max(most_mm, (map.deformed_of(v.cast<double>()) - v.cast<double>()).norm());
    // A patch is scaled by a sample of the vertices.
    EXPECT_NEAR(most_mm, amplitude_mm, GetParam() == DeformationKind::bezier ? 0.02 : 1e-3);
    for (std::uint64_t i = 0; i < 300; ++i) {
      const Vector3d share(hashed_uniform(5, 3 * i), hashed_uniform(5, 3 * i + 1), hashed_uniform(5, 3 * i + 2));
      const Vector3d now = map.low_mm() + share.cwiseProduct(map.high_mm() - map.low_mm());
      EXPECT_LT((map.deformed_of(map.rest_of(now)) - now).norm(), 1e-6);
      EXPECT_LT((map.rest_of(map.deformed_of(now)) - now).norm(), 1e-6);
      EXPECT_LT((map.rest_of(now) - now - map.displacement_mm(now)).norm(), 1e-9);
      EXPECT_GT(map.jacobian(now).determinant(), TissueMap::kLeastDeterminant);
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = 1e-4 * Vector3d::Unit(axis);
        const Vector3d slope = (map.rest_of(now + step) - map.rest_of(now - step)) / 2e-4;
        EXPECT_LT((slope - map.jacobian(now).col(axis)).norm(), 1e-5);
      }
    }
  }
}

TEST_P(EachKind, FollowsFromItsSeedAlone) {
  const Subject subject = lump();
  const auto place_now = [&](std::uint64_t seed) {
    const auto drawn = draw_deformation(subject, {.kind = GetParam()}, seed);
    EXPECT_TRUE(drawn);
    return drawn->map->deformed_of({20, -10, 15});
  };
  EXPECT_EQ(place_now(1), place_now(1));
  EXPECT_NE(place_now(1), place_now(2));
}

TEST_P(EachKind, MovesAPatientsLiverAsItIsDrawnFromTheFilesOfThePatient) {
  const testing::Scratch patient;
  const Subject subject = lump();
  ASSERT_TRUE(std::filesystem::create_directory(patient / "surfaces"));
  ASSERT_TRUE(write_ply(patient / "surfaces" / "liver.ply", subject.surface));
  ASSERT_TRUE(write_labels(patient / "segmentation.nii.gz", subject.grid, subject.labels));
  const auto shape = liver_shape(patient.path());
  ASSERT_TRUE(shape) << shape.error().what;
  EXPECT_TRUE((shape->grid.origin_mm - subject.grid.origin_mm).cwiseAbs().maxCoeff() <= 4) << "a voxel";
  EXPECT_EQ(std::count(shape->labels.begin(), shape->labels.end(), 1),
            std::count(subject.labels.begin(), subject.labels.end(), 1));
  const auto drawn = draw_deformation(*shape, {.kind = GetParam()}, 7);
  ASSERT_TRUE(drawn) << drawn.error().what;
  double most_mm = 0;
  for (const Eigen::Vector3f& v : shape->surface.vertices)
    most_mm = std::max(most_mm, (drawn->map->deformed_of(v.cast<double>()) - v.cast<double>()).norm());
  EXPECT_NEAR(most_mm, 10, GetParam() == DeformationKind::bezier ? 0.02 : 1e-3);
}

TEST(Deformation, OfAPatientWithoutASegmentationIsRefused) {
  const testing::Scratch patient;
  ASSERT_TRUE(std::filesystem::create_directory(patient / "surfaces"));
  ASSERT_TRUE(write_ply(patient / "surfaces" / "liver.ply", lump().surface));
  const auto shape = liver_shape(patient.path());
  ASSERT_FALSE(shape);
  EXPECT_NE(shape.error().what.find("segmentation.nii.gz"), std::string::npos) << shape.error().what;
}

TEST(Deformation, IsRefusedWhereItFoldsOrLeavesTheScan) {
  const Subject subject = lump();
  for (const DeformationKind kind : {DeformationKind::bend, DeformationKind::push, DeformationKind::breathing}) {
    const auto drawn = draw_deformation(subject, {.kind = kind, .amplitude_mm = 95}, 11);
    ASSERT_FALSE(drawn);
    EXPECT_NE(drawn.error().what.find("by 95 mm"), std::string::npos) << drawn.error().what;
    EXPECT_NE(drawn.error().what.find(name_of(kind)), std::string::npos) << drawn.error().what;
  }
}

TEST(Deformation, OfACompressionOrTwistKeepsEachVolume) {
  const Subject subject = lump();
  for (const DeformationKind kind : {DeformationKind::compression, DeformationKind::twist}) {
    const auto drawn = draw_deformation(subject, {.kind = kind, .amplitude_mm = 12}, 3);
    ASSERT_TRUE(drawn);
    EXPECT_NEAR(drawn->map->least_determinant(), 1, 1e-6);
  }
}

TEST(Deformation, OfAPushIsAsWideAsGivenAndLeavesTheRestStill) {
  const Subject subject = lump();
  for (const double width_mm : {25.0, 50.0}) {
    const auto drawn =
        draw_deformation(subject, {.kind = DeformationKind::push, .amplitude_mm = 8, .push_width_mm = width_mm}, 4);
    ASSERT_TRUE(drawn);
    const auto number = [&](const std::string& wanted) {
      const auto found = std::find_if(drawn->numbers.begin(), drawn->numbers.end(),
                                      [&](const DrawnNumber& n) { return n.name == wanted; });
      return Vector3d(found->values.data());
    };
    const Vector3d tip = number("tip_mm");
    const Vector3d inwards = number("direction");
    const Vector3d aside = inwards.cross(Vector3d(0.3, 0.5, 0.8)).normalized();
    const auto dent_mm = [&](const Vector3d& rest) { return (drawn->map->deformed_of(rest) - rest).dot(inwards); };
    EXPECT_NEAR(dent_mm(tip), 8, 1e-3);
    EXPECT_NEAR(dent_mm(tip + 0.5 * width_mm * aside), 4, 1e-3);
    EXPECT_LT(dent_mm(tip + 2 * width_mm * aside), 0.01);
    EXPECT_LT(dent_mm(tip + 3 * width_mm * inwards), 0.1);
  }
}

TEST(Deformation, OfBreathComesFromAboveAndOfGasFromTheFront) {
  const Subject subject = lump();
  const auto [low, high] = bounds(subject.surface);
  const Vector3d middle = 0.5 * (low + high);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto breath = draw_deformation(subject, {.kind = DeformationKind::breathing}, seed);
    const auto gas = draw_deformation(subject, {.kind = DeformationKind::pneumoperitoneum}, seed);
    ASSERT_TRUE(breath);
    ASSERT_TRUE(gas);
    const auto moved = [](const DrawnDeformation& by, const Vector3d& p) -> Vector3d {
      return by.map->deformed_of(p) - p;
    };
    const Vector3d up(0, 0, 0.4 * (high.z() - low.z()));
    EXPECT_LT(moved(*breath, middle + up).z(), moved(*breath, middle - up).z());
    EXPECT_LT(moved(*breath, middle - up).z(), 0);
    const Vector3d front(0, -0.45 * (high.y() - low.y()), 0);
    EXPECT_GT(moved(*gas, middle + front).y(), 2 * std::abs(moved(*gas, middle - front).y()));
    const Vector3d left(0.4 * (high.x() - low.x()), 0, 0);
    EXPECT_GT(moved(*gas, middle + left).x(), 0);
    EXPECT_LT(moved(*gas, middle - left).x(), 0);
  }
}

TEST(Deformation, IsNamedByKindOrByDegreesOfFreedom) {
  DeformationSettings settings;
  EXPECT_TRUE(parse_deformation("", "", settings));
  EXPECT_EQ(settings.kind, DeformationKind::elastic);
  EXPECT_TRUE(parse_deformation("twist", "", settings));
  EXPECT_EQ(settings.kind, DeformationKind::twist);
  EXPECT_TRUE(parse_deformation("", "81", settings));
  EXPECT_EQ(settings.kind, DeformationKind::bezier);
  EXPECT_EQ(settings.inner, (std::array<int, 3>{3, 3, 3}));
  EXPECT_FALSE(parse_deformation("bend", "3", settings));
  EXPECT_FALSE(parse_deformation("pull", "", settings));
}

}  // namespace
}  // namespace birdseye::hw_sim
