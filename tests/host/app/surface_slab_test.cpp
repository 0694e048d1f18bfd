#include "host/registration/rigid/surface_slab.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/command.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

/// An open square of 20 mm, level, 50 mm in front of the origin.
Surface square() {
  Surface s;
  s.vertices_mm = {{-10, -10, 50}, {10, -10, 50}, {10, 10, 50}, {-10, 10, 50}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  return s;
}

int hu_at(const Volume& v, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d voxel = v.patient_from_voxel.inverse() * point_mm;
  return v.at(static_cast<int>(std::lround(voxel.x())), static_cast<int>(std::lround(voxel.y())),
              static_cast<int>(std::lround(voxel.z())));
}

TEST(SurfaceSlab, LiesBehindTheSurfaceAwayFromTheEye) {
  for (const double eye_z_mm : {0.0, 100.0}) {
    SlabSettings settings;
    settings.seen_from_mm = {0, 0, eye_z_mm};
    const auto v = slab_behind(square(), settings);
    ASSERT_TRUE(v) << v.error().what;
    const double away = eye_z_mm == 0 ? 1 : -1;
    EXPECT_EQ(hu_at(*v, {0, 0, 50 + 4 * away}), 100);
    EXPECT_EQ(hu_at(*v, {0, 0, 50 - 2 * away}), -1000);
    EXPECT_EQ(hu_at(*v, {0, 0, 50 + 10 * away}), -1000);
    EXPECT_EQ(hu_at(*v, {13, 0, 50 + 2 * away}), -1000);
    // The sides go along the lines of sight, apart from the eye.
    EXPECT_EQ(hu_at(*v, {10.8, 0, 50 + 7 * away}), 100);
  }
}

/// The mass of tissue is that of the frustum behind the square, as voxels of the border hold their share: the eye's
/// solid angle cut at 50 mm by a plane and 8 mm further along each line of sight.
TEST(SurfaceSlab, ShareOfBorderVoxelsGivesItsVolume) {
  SlabSettings settings;
  settings.spacing_mm = 0.5;
  const auto v = slab_behind(square(), settings);
  ASSERT_TRUE(v);
  double volume_mm3 = 0;
  for (const std::int16_t hu : v->hu) volume_mm3 += (hu + 1000) / 1100.0 * std::pow(settings.spacing_mm, 3);
  double expected_mm3 = 0;
  constexpr int kParts = 200;
  for (int i = 0; i < kParts; ++i) {
    for (int j = 0; j < kParts; ++j) {
      const double x = -10 + 20 * (i + 0.5) / kParts, y = -10 + 20 * (j + 0.5) / kParts;
      const double near_mm = std::sqrt(x * x + y * y + 2500),
                   solid_angle = 50 / std::pow(near_mm, 3) * 400 / kParts / kParts;
      expected_mm3 += solid_angle * (std::pow(near_mm + 8, 3) - std::pow(near_mm, 3)) / 3;
    }
  }
  EXPECT_NEAR(volume_mm3, expected_mm3, 0.01 * expected_mm3);
}

TEST(SurfaceSlab, RefusesWhatMakesNoSlab) {
  SlabSettings settings;
  settings.spacing_mm = 0;
  EXPECT_FALSE(slab_behind(square(), settings));
  settings = {};
  settings.spacing_mm = 0.01;
  EXPECT_FALSE(slab_behind(square(), settings));
  settings = {};
  settings.seen_from_mm = {200, 0, 50};  // in its plane
  EXPECT_FALSE(slab_behind(square(), settings));
  for (const double far_mm : {1e5 + 1, 1e20, 1e300}) {
    settings.seen_from_mm = {0, 0, far_mm};
    const auto v = slab_behind(square(), settings);
    ASSERT_FALSE(v) << far_mm;
    EXPECT_NE(v.error().what.find("the eye point is"), std::string::npos) << v.error().what;
  }
  // Embree itself would end the program.
  const SurfaceIndex index(square());
  EXPECT_TRUE(index.first_hit_mm({0, 0, 0}, {0, 0, 1}));
  for (const double far_mm : {1e20, 1e300, std::nan("")}) {
    EXPECT_FALSE(index.first_hit_mm({0, 0, far_mm}, {0, 0, -1})) << far_mm;
    EXPECT_FALSE(index.first_hit_mm({0, 0, 0}, {0, 0, far_mm})) << far_mm;
  }
}

TEST(VolumeFromSurface, WritesAVolumeAndRefusesInOneLine) {
  const testing::Scratch scratch;
  const std::string surface =
      scratch.file("square.obj", "v -10 -10 50\nv 10 -10 50\nv 10 10 50\nv -10 10 50\nf 1 2 3\nf 1 3 4\n");
  const std::string out = (scratch / "slab.nii.gz").string();
  const auto result = testing::run("birdseye", "volume from-surface " + surface + " --depth-mm 5 --out " + out);
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_NE(testing::run("birdseye", "volume info " + out).output.find("HU           -1000 to 100"), std::string::npos);
  const std::string other = (scratch / "none.nii.gz").string();
  testing::expect_refused("birdseye", "volume from-surface " + surface + " --seen-from 200,0,50 --out " + other,
                          {"square.obj", "eye point"}, other);
  testing::expect_refused("birdseye", "volume from-surface " + (scratch / "none.stl").string() + " --out " + other,
                          {"none.stl", "no such file"}, other);
}

}  // namespace
}  // namespace birdseye::host
