#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <string>

#include "host/deform/bezier_patch.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/deform/patch_octree.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> random_displacements(const PatchOctree& tree, double amount, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  std::vector<Vector3d> out;
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) out.emplace_back(uniform(rng), uniform(rng), uniform(rng));
  return out;
}

/// Level 3 in one half of the cube, level 1 in the other.
PatchOctree mixed() {
  return *PatchOctree::adaptive(
      [](const Vector3d& low, const Vector3d&, int level) { return level < 1 || low.x() < 0.49; }, 3);
}

TEST(PatchOctree, HasThePapersFreeVertices) {
  const std::size_t expected[] = {0, 1, 27, 343, 3375, 29791};
  for (int level = 0; level <= 5; ++level) {
    const auto tree = PatchOctree::uniform(level);
    ASSERT_TRUE(tree);
    EXPECT_EQ(tree->free_vertices(), expected[level]);
    EXPECT_EQ(tree->patches().size(), std::size_t{1} << (3 * level));
  }
  EXPECT_FALSE(PatchOctree::uniform(6));
  EXPECT_FALSE(PatchOctree::uniform(-1));
}

TEST(PatchOctree, AtRestNothingMoves) {
  const PatchOctree tree = mixed();
  EXPECT_EQ(tree.displacement({0.3, 0.7, 0.2}), Vector3d::Zero());
  EXPECT_EQ(tree.jacobian({0.3, 0.7, 0.2}), Eigen::Matrix3d::Identity());
}

TEST(PatchOctree, IsContinuousWhereLevelsMeet) {
  PatchOctree tree = mixed();
  // Vertices of the small patches in the face between the halves hang on the large ones: only its corners are free.
  std::size_t in_face = 0;
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) in_face += std::abs(tree.vertex(i).x() - 0.5) < 1e-9 ? 1 : 0;
  EXPECT_EQ(in_face, 1U);
  tree.set_displacements(random_displacements(tree, 0.05, 4));
  constexpr double kStep = 1e-9;
  double largest = 0;
  for (int i = 1; i < 40; ++i) {
    for (int j = 1; j < 40; ++j) {
      const Vector3d below(0.5 - kStep, i / 40.0, j / 40.0);
      const Vector3d above(0.5 + kStep, i / 40.0, j / 40.0);
      EXPECT_LT((tree.displacement(below) - tree.displacement(above)).norm(), 1e-7);
      largest = std::max(largest, tree.displacement(below).norm());
    }
  }
  EXPECT_GT(largest, 0.01);
}

TEST(PatchOctree, InterpolatesItsVerticesAndHoldsTheSurface) {
  PatchOctree tree = *PatchOctree::uniform(2);
  const auto moved = random_displacements(tree, 0.04, 8);
  tree.set_displacements(moved);
  for (std::size_t i = 0; i < moved.size(); ++i)
    EXPECT_LT((tree.displacement(tree.vertex(i)) - moved[i]).norm(), 1e-12);
  EXPECT_EQ(tree.displacements().size(), moved.size());
  EXPECT_EQ(tree.displacement({0, 0.3, 0.6}), Vector3d::Zero());
  EXPECT_EQ(tree.displacement({0.4, 1, 0.6}), Vector3d::Zero());
  EXPECT_EQ(tree.displacement({1.2, 0.5, 0.5}), Vector3d::Zero());
}

TEST(PatchOctree, JacobianIsWhatCentralDifferencesSay) {
  PatchOctree tree = mixed();
  tree.set_displacements(random_displacements(tree, 0.02, 15));
  for (const Vector3d& x : {Vector3d(0.31, 0.42, 0.77), Vector3d(0.8, 0.2, 0.3), Vector3d(0.13, 0.9, 0.55)}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d e = 1e-6 * Vector3d::Unit(axis);
      const Vector3d numeric = (2 * e + tree.displacement(x + e) - tree.displacement(x - e)) / 2e-6;
      EXPECT_LT((tree.jacobian(x).col(axis) - numeric).norm(), 1e-8);
    }
  }
}

TEST(PatchOctree, InverseUndoesTheMap) {
  for (const int level : {1, 3, 5}) {
    PatchOctree tree = *PatchOctree::uniform(level);
    tree.set_displacements(random_displacements(tree, 0.18 / (1 << level), 21));
    std::mt19937 rng(3);
    std::uniform_real_distribution<double> uniform(0.02, 0.98);
    for (int i = 0; i < 300; ++i) {
      const Vector3d x(uniform(rng), uniform(rng), uniform(rng));
      const auto back = tree.inverse(x + tree.displacement(x), 1e-9);
      ASSERT_TRUE(back) << level;
      EXPECT_LT((*back - x).norm(), 1e-7);
    }
  }
}

TEST(BezierPatch, OneInnerPointOfDegreeTwoIsTheProductOfItsPolynomials) {
  BezierPatch patch = *BezierPatch::create({2, 2, 2});
  EXPECT_EQ(patch.free_points(), 1U);
  patch.set_displacements({Vector3d(0.1, -0.2, 0.05)});
  const Vector3d x(0.3, 0.6, 0.8);
  const auto b = [](double t) { return 2 * t * (1 - t); };
  EXPECT_LT((patch.displacement(x) - b(0.3) * b(0.6) * b(0.8) * Vector3d(0.1, -0.2, 0.05)).norm(), 1e-15);
  EXPECT_EQ(patch.displacement({0, 0.5, 0.5}), Vector3d::Zero());
}

TEST(BezierPatch, AnyDegreePerAxisSumsToOneAndDrivesTheVertices) {
  BezierPatch patch = *BezierPatch::create({3, 5, 16});
  EXPECT_EQ(patch.free_points(), 2U * 4U * 15U);
  std::vector<Vector3d> displacements(patch.free_points(), Vector3d(0.02, 0, 0));
  patch.set_displacements(displacements);
  // All inner points alike: short of the whole displacement by the share of the points of the surface.
  EXPECT_GT(patch.displacement({0.5, 0.5, 0.5}).x(), 0.012);
  EXPECT_LT(patch.displacement({0.5, 0.5, 0.5}).x(), 0.02);
  PatchOctree tree = *PatchOctree::uniform(3);
  patch.drive(tree);
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) {
    EXPECT_LT((tree.displacement(tree.vertex(i)) - patch.displacement(tree.vertex(i))).norm(), 1e-12);
  }
  EXPECT_FALSE(BezierPatch::create({0, 2, 2}));
  EXPECT_FALSE(BezierPatch::create({2, 2, 17}));
}

Eigen::Affine3d oblique_box() {
  Eigen::Affine3d box = Eigen::Affine3d::Identity();
  box.rotate(Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()));
  box.scale(Vector3d(120, 90, 150));
  box.translation() = Vector3d(-40, 10, 200);
  return box;
}

TEST(DisplacementField, IsTheOctreeExactly) {
  PatchOctree tree = mixed();
  tree.set_displacements(random_displacements(tree, 0.03, 2));
  const Eigen::Affine3d box = oblique_box();
  const DisplacementField field = field_of(tree, box);
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> uniform(0.001, 0.999);
  for (int i = 0; i < 500; ++i) {
    const Vector3d x(uniform(rng), uniform(rng), uniform(rng));
    EXPECT_LT((field.displacement(box * x) - box.linear() * tree.displacement(x)).norm(), 2e-6);
  }
  EXPECT_EQ(field.displacement(box * Vector3d(1.2, 0.5, 0.5)), Vector3d::Zero());
}

TEST(DisplacementField, ComesBackFromItsFileInEveryFormat) {
  const testing::Scratch scratch;
  PatchOctree tree = *PatchOctree::uniform(2);
  tree.set_displacements(random_displacements(tree, 0.02, 6));
  const DisplacementField field = field_of(tree, oblique_box());
  for (const char* name : {"f.mha", "f.nrrd", "f.nii.gz"}) {
    ASSERT_TRUE(write_field(scratch / name, field)) << name;
    const auto back = read_field(scratch / name);
    ASSERT_TRUE(back) << back.error().what;
    EXPECT_EQ(back->size, field.size);
    for (const Vector3d& x : {Vector3d(0.3, 0.4, 0.7), Vector3d(0.9, 0.1, 0.5)}) {
      const Vector3d p = oblique_box() * x;
      EXPECT_LT((back->displacement(p) - field.displacement(p)).norm(), 1e-3) << name;
    }
  }
}

TEST(DisplacementField, RefusesWhatIsNoSoundField) {
  const testing::Scratch scratch;
  EXPECT_EQ(read_field(scratch / "none.mha").error().code, Errc::not_found);
  EXPECT_EQ(read_field(scratch.file("text.mha", "no field")).error().code, Errc::bad_format);
  PatchOctree tree = *PatchOctree::uniform(1);
  tree.set_displacements({Vector3d(0.8, 0, 0)});
  ASSERT_TRUE(write_field(scratch / "fold.mha", field_of(tree, oblique_box())));
  const auto folded = read_field(scratch / "fold.mha");
  ASSERT_FALSE(folded);
  EXPECT_NE(folded.error().what.find("folds"), std::string::npos);
  tree.set_displacements({Vector3d(NAN, 0, 0)});
  ASSERT_TRUE(write_field(scratch / "nan.mha", field_of(tree, oblique_box())));
  EXPECT_NE(read_field(scratch / "nan.mha").error().what.find("not finite"), std::string::npos);
  DisplacementField far = field_of(*PatchOctree::uniform(1), oblique_box());
  for (Eigen::Vector3f& displacement : far.displacement_mm)
    displacement.setConstant(1e30F);  // as one, so nothing folds
  ASSERT_TRUE(write_field(scratch / "far.mha", far));
  EXPECT_NE(read_field(scratch / "far.mha").error().what.find("as an organ moves"), std::string::npos);
  EXPECT_FALSE(write_field(scratch / "field.txt", field_of(tree, oblique_box())));
  // Its reader would turn the place of such a field to the patient's LPS, and no vectors.
  ASSERT_TRUE(write_field(scratch / "lps.nrrd", field_of(*PatchOctree::uniform(1), oblique_box())));
  std::string text = testing::contents_of(scratch / "lps.nrrd");
  const std::string space = "left-posterior-superior";
  ASSERT_NE(text.find(space), std::string::npos);
  text.replace(text.find(space), space.size(), "right-anterior-superior");
  const auto turned = read_field(scratch.file("ras.nrrd", text));
  ASSERT_FALSE(turned);
  EXPECT_NE(turned.error().what.find("in the space \"right-anterior-superior\""), std::string::npos);
}

TEST(DisplacementField, RefusesToTearOrToMissTheVolume) {
  Volume volume;
  volume.size = {20, 20, 20};
  volume.hu.assign(8000, 0);
  DisplacementField field;
  field.size = {5, 5, 5};
  field.patient_from_lattice.linear() = 5 * Eigen::Matrix3d::Identity();
  field.displacement_mm.assign(125, Eigen::Vector3f(0, 3, 0));
  EXPECT_TRUE(check_covers(field, volume));  // it ends beyond the volume, where it may move what it likes
  field.patient_from_lattice.linear() *= 0.5;
  EXPECT_FALSE(check_covers(field, volume));
  for (Eigen::Vector3f& u : field.displacement_mm) u *= 0.1F;
  EXPECT_TRUE(check_covers(field, volume));
  field.patient_from_lattice.translation() = Eigen::Vector3d(500, 0, 0);
  EXPECT_FALSE(check_covers(field, volume));
}

}  // namespace
}  // namespace birdseye::host
