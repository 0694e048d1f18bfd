#include "host/deform/transform_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "calibration/geometry/transform.hpp"
#include "host/deform/deformed_volume.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::Scratch;

/// Smooth, turned against the axes, still at its borders.
DisplacementField field() {
  DisplacementField out;
  out.size = {9, 8, 7};
  out.patient_from_lattice.linear() = rotation_exp(Eigen::Vector3d(0.1, -0.2, 0.3)) * Eigen::Scaling(10.0, 12.0, 9.0);
  out.patient_from_lattice.translation() = Eigen::Vector3d(-40, 30, 1100);
  for (int k = 0; k < 7; ++k) {
    for (int j = 0; j < 8; ++j) {
      for (int i = 0; i < 9; ++i) {
        const double bump = std::sin(M_PI * i / 8) * std::sin(M_PI * j / 7) * std::sin(M_PI * k / 6);
        out.displacement_mm.emplace_back(Eigen::Vector3d(6 * bump, -4 * bump, 3 * bump).cast<float>());
      }
    }
  }
  return out;
}

Eigen::Matrix4d rigid() {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_exp(Eigen::Vector3d(1.2, 0.4, -0.7));
  m.topRightCorner<3, 1>() = Eigen::Vector3d(-310.25, 120.5, 990.75);
  return m;
}

/// Landmarks all over the field, where they are seen, in the tracker's frame.
std::vector<Eigen::Vector3d> landmarks(const DisplacementField& of) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(0.1, 0.9);
  std::vector<Eigen::Vector3d> out;
  const Eigen::Affine3d seen_from_ct = Eigen::Affine3d(rigid()).inverse();
  for (int n = 0; n < 50; ++n) {
    const Eigen::Vector3d lattice(8 * within(random), 7 * within(random), 6 * within(random));
    out.emplace_back(seen_from_ct * of.patient_from_lattice * lattice);
  }
  return out;
}

TEST(TransformFile, ItkTakesLandmarksWhereWeDo) {
  const Scratch scratch;
  const DisplacementField u = field();
  for (const char* name : {"map.h5", "map.tfm"}) {
    for (const bool deformed : {true, false}) {
      const RestMap map{rigid(), deformed ? &u : nullptr};
      const auto written = write_transform(scratch / name, map);
      ASSERT_TRUE(written) << written.error().what;
      const auto points = landmarks(u);
      const auto mapped = transform_by_file(scratch / name, points);
      ASSERT_TRUE(mapped) << mapped.error().what;
      double moved_mm = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        // By the definition: first to the frame of the CT, then p + u(p).
        const Eigen::Vector3d p = (rigid() * points[i].homogeneous()).hnormalized();
        const Eigen::Vector3d rest = deformed ? Eigen::Vector3d(p + u.displacement(p)) : p;
        EXPECT_LT(((*mapped)[i] - rest).norm(), 1e-3) << name << i;
        moved_mm = std::max(moved_mm, (rest - p).norm());
      }
      EXPECT_EQ(moved_mm > 3, deformed);
    }
  }
}

TEST(TransformFile, TheDisplacementFieldAloneIsTheSameMap) {
  const Scratch scratch;
  const DisplacementField u = field();
  ASSERT_TRUE(write_field(scratch / "u.nrrd", u));
  const auto read = read_field(scratch / "u.nrrd");
  ASSERT_TRUE(read) << read.error().what;
  for (const Eigen::Vector3d& seen : landmarks(u)) {
    const Eigen::Vector3d p = (rigid() * seen.homogeneous()).hnormalized();
    EXPECT_LT((read->displacement(p) - u.displacement(p)).norm(), 1e-4);
  }
}

TEST(TransformFile, WhatCannotBeReadOrWrittenIsNamed) {
  const Scratch scratch;
  EXPECT_FALSE(write_transform(scratch / "map.png", {}));
  EXPECT_FALSE(write_transform(scratch / "none/map.tfm", {}));
  for (const char* name : {"bad.tfm", "bad.h5"}) {
    const auto read = transform_by_file(scratch.file(name, "#Insight Transform File V1.0\nTransform: Nonsense\n"), {});
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().what.find(name), std::string::npos) << read.error().what;
  }
  EXPECT_FALSE(transform_by_file(scratch / "none.h5", {}));
}

TEST(TransformFile, WhatLiesBesideItStays) {
  const Scratch scratch;
  (void)scratch.file("victim", "a user's");
  fs::create_directory(scratch / "dir.tfm");
  for (const char* name : {"map.tfm", "map.h5"}) {
    const std::string former = std::string("part-") + name;
    fs::create_symlink("victim", scratch / former);
    const auto written = write_transform(scratch / name, {});
    ASSERT_TRUE(written) << written.error().what;
    EXPECT_FALSE(fs::is_symlink(scratch / name)) << name;
    EXPECT_TRUE(fs::is_symlink(scratch / former)) << name;
  }
  EXPECT_EQ(testing::contents_of(scratch / "victim"), "a user's");
  const auto refused = write_transform(scratch / "dir.tfm", {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("dir.tfm: is a folder"), std::string::npos) << refused.error().what;
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 6) << "nothing is left of it";
}

TEST(DeformedVolume, HoldsAtAPlaceWhatTheCtHasWhereItCameFrom) {
  Volume ct;
  ct.size = {40, 36, 30};
  ct.spacing_mm = {2, 2.5, 2};
  ct.patient_from_voxel.linear() = rotation_exp(Eigen::Vector3d(0.1, -0.2, 0.3)) * Eigen::Scaling(ct.spacing_mm);
  ct.patient_from_voxel.translation() = field().patient_from_lattice.translation();
  const auto hu_at = [&](const Eigen::Vector3d& voxel) { return 10 * voxel.x() - 7 * voxel.y() + 5 * voxel.z(); };
  for (int k = 0; k < 30; ++k) {
    for (int j = 0; j < 36; ++j) {
      for (int i = 0; i < 40; ++i) ct.hu.push_back(static_cast<std::int16_t>(hu_at({1.0 * i, 1.0 * j, 1.0 * k})));
    }
  }
  const DisplacementField u = field();
  const Volume seen = deformed_volume(ct, u);
  std::size_t moved = 0;
  for (int k = 3; k < 27; k += 3) {
    for (int j = 3; j < 33; j += 3) {
      for (int i = 3; i < 37; i += 3) {
        const Eigen::Vector3d p = ct.patient_from_voxel * Eigen::Vector3d(i, j, k);
        const Eigen::Vector3d rest = ct.patient_from_voxel.inverse() * Eigen::Vector3d(p + u.displacement(p));
        // Linear in the voxel, so that trilinear is exact; half an HU is rounding.
        EXPECT_NEAR(seen.at(i, j, k), hu_at(rest), 0.5001);
        moved += seen.at(i, j, k) != ct.at(i, j, k) ? 1U : 0U;
      }
    }
  }
  EXPECT_GT(moved, 300U);
  // What comes from outside is air.
  DisplacementField away = u;
  away.displacement_mm.assign(away.displacement_mm.size(), Eigen::Vector3f(500, 0, 0));
  EXPECT_EQ(deformed_volume(ct, away).at(20, 18, 15), -1024);
}

}  // namespace
}  // namespace birdseye::host
