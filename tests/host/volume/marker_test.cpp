#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "host/volume/import.hpp"
#include "host/volume/marker_finder.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye::host {
namespace {

using Eigen::Vector3d;

/// A piece of a patient: skin at y = 0, air before it (negative y), soft tissue behind.
class Scene {
 public:
  explicit Scene(const Vector3d& spacing_mm, bool oblique = false) {
    const Vector3d size_mm(120, 80, 90);
    ct.spacing_mm = spacing_mm;
    for (int axis = 0; axis < 3; ++axis)
      ct.size[static_cast<std::size_t>(axis)] = static_cast<int>(std::lround(size_mm[axis] / spacing_mm[axis]));
    const Eigen::Matrix3d turn =
        oblique ? rotation_of(Vector3d(0.1, 0.05, -0.1)) : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    ct.patient_from_voxel.linear() = turn * spacing_mm.asDiagonal();
    ct.patient_from_voxel.translation() = turn * Vector3d(-60.2, -39.7, -44.9);
    ct.hu.assign(grid_count(ct.size), 0);
    for (int k = 0; k < ct.size[2]; ++k) {
      for (int j = 0; j < ct.size[1]; ++j) {
        for (int i = 0; i < ct.size[0]; ++i) {
          const double skin = (ct.patient_from_voxel * Vector3d(i, j, k)).y() / spacing_mm.y() + 0.5;
          ct.hu[ct.index(i, j, k)] = static_cast<std::int16_t>(std::lround(-1000 + 1040 * std::clamp(skin, 0.0, 1.0)));
        }
      }
    }
  }

  static Eigen::Matrix3d rotation_of(const Vector3d& v) {
    return Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix();
  }

  /// Mixes hu into each voxel by the share of it that lies inside.
  /// outside: how far a point lies outside of the thing, mm.
  template <typename Outside>
  void fill(const Vector3d& centre, double reach_mm, const Outside& outside, double hu) {
    const Vector3d middle = ct.patient_from_voxel.inverse() * centre;
    const Eigen::Array3d reach = reach_mm / ct.spacing_mm.array() + 1;
    const Eigen::Array3i low = (middle.array() - reach).cast<int>().max(0);
    const Eigen::Array3i high =
        (middle.array() + reach).cast<int>().min(Eigen::Array3i(ct.size[0], ct.size[1], ct.size[2]) - 1);
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) mix({i, j, k}, outside, hu);
      }
    }
  }
  void put(const MarkerShape& shape, const Vector3d& centre, const Vector3d& axis, double hu) {
    fill(
        centre, shape.widest_mm(), [&](const Vector3d& p) { return shape.outside_mm(p - centre, axis); }, hu);
  }
  void noise(double sigma_hu, unsigned seed) {
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal(0, sigma_hu);
    for (std::int16_t& hu : ct.hu) hu = static_cast<std::int16_t>(std::lround(hu + normal(rng)));
  }
  /// In voxels, the largest along any axis.
  [[nodiscard]] double off_voxels(const Vector3d& a, const Vector3d& b) const {
    return (ct.patient_from_voxel.linear().inverse() * (a - b)).cwiseAbs().maxCoeff();
  }

  Volume ct;

 private:
  template <typename Outside>
  void mix(const Eigen::Array3i& at, const Outside& outside, double hu) {
    constexpr int kParts = 7;
    const Vector3d voxel = at.cast<double>().matrix();
    const double here = outside(ct.patient_from_voxel * voxel);
    const double half_mm = 0.5 * ct.spacing_mm.norm();
    double share = here < 0 ? 1 : 0;
    if (std::abs(here) < half_mm) {
      int filled = 0;
      for (int part = 0; part < kParts * kParts * kParts; ++part) {
        const Eigen::Array3i cell(part % kParts, part / kParts % kParts, part / (kParts * kParts));
        const Vector3d offset = ((cell.cast<double>() + 0.5) / kParts - 0.5).matrix();
        filled += outside(ct.patient_from_voxel * Vector3d(voxel + offset)) < 0 ? 1 : 0;
      }
      share = filled / static_cast<double>(kParts * kParts * kParts);
    }
    std::int16_t& was = ct.hu[ct.index(at[0], at[1], at[2])];
    was = static_cast<std::int16_t>(std::lround(was + share * (hu - was)));
  }
};

struct Kind {
  const char* name;
  MarkerShape shape;
  double hu;
};
const Kind kKinds[] = {
    {"ball", {MarkerKind::ball, 8, 0, 0}, 2500},         {"plastic ball", {MarkerKind::ball, 10, 0, 0}, 500},
    {"small ball", {MarkerKind::ball, 4, 0, 0}, 2500},   {"ring", {MarkerKind::ring, 15, 5, 0}, 900},
    {"cylinder", {MarkerKind::cylinder, 15, 5, 4}, 900}, {"tube", {MarkerKind::cylinder, 8, 3, 14}, 1200}};
const Vector3d kSpacings[] = {{0.7, 0.7, 0.7}, {0.7, 0.7, 2.5}, {1.5, 1.5, 2.0}};

TEST(Markers, CentresAreFoundToAFifthOfAVoxel) {
  int within = 0;
  int all = 0;
  for (const Kind& kind : kKinds) {
    for (const Vector3d& spacing : kSpacings) {
      SCOPED_TRACE(::testing::Message() << kind.name << " in voxels of " << spacing.transpose());
      Scene scene(spacing, true);
      std::mt19937 rng(11);
      std::uniform_real_distribution<double> uniform(-1, 1);
      std::vector<std::pair<Vector3d, Vector3d>> truth;
      for (int i = 0; i < 6; ++i) {
        // On the skin, their axes tilted from it.
        const Vector3d axis = Vector3d(0.5 * uniform(rng), -1, 0.5 * uniform(rng)).normalized();
        const double height = kind.shape.half_extent_mm(Vector3d::UnitY(), axis);
        const Vector3d centre(36 * (i % 3 - 1) + 3 * uniform(rng), -height, (i < 3 ? -20 : 20) + 3 * uniform(rng));
        scene.put(kind.shape, centre, axis, kind.hu);
        truth.emplace_back(centre, axis);
      }
      scene.noise(25, 4);
      const FoundMarkers found = find_markers(scene.ct, {kind.shape, std::nullopt});
      ASSERT_EQ(found.markers.size(), truth.size());
      EXPECT_TRUE(found.doubtful.empty());
      for (const auto& [centre, axis] : truth) {
        const MarkerFit& nearest = *std::min_element(
            found.markers.begin(), found.markers.end(), [&c = centre](const MarkerFit& a, const MarkerFit& b) {
              return (a.centre_in_patient_mm - c).norm() < (b.centre_in_patient_mm - c).norm();
            });
        EXPECT_LE(scene.off_voxels(nearest.centre_in_patient_mm, centre), 0.2);
        const double off_mm = (nearest.centre_in_patient_mm - centre).norm();
        within += off_mm < kSigmasOf95 * nearest.sigma_mm ? 1 : 0;
        ++all;
        EXPECT_NEAR(nearest.hu, kind.hu, 0.15 * kind.hu);
        if (kind.shape.kind != MarkerKind::ball) {
          EXPECT_GT(std::abs(nearest.axis.dot(axis)), std::cos(0.1));
        }
      }
    }
  }
  EXPECT_GE(within, 0.9 * all);
}

TEST(Markers, ClutterIsNotReported) {
  Scene scene({0.7, 0.7, 2.5});
  const Vector3d up = Vector3d::UnitZ();
  const MarkerShape ball{MarkerKind::ball, 8, 0, 0};
  scene.put(ball, {0.3, -4, 1.2}, up, 2500);
  const auto rod = [&](const Vector3d& a, const Vector3d& b, double radius_mm, double hu) {
    scene.fill(
        0.5 * (a + b), 0.5 * (a - b).norm() + radius_mm,
        [&](const Vector3d& p) {
          const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
          return (p - a - along * (b - a)).norm() - radius_mm;
        },
        hu);
  };
  rod({-55, 20, -30}, {55, 15, -20}, 5, 900);                           // a rib
  rod({-40, 20, 20}, {-20, 20, 22}, 4, 900);                            // the end of one
  rod({20, 20, 20}, {26, 20, 20}, 0.8, 3000);                           // clips
  rod({30, 30, 25}, {30, 36, 25}, 0.8, 3000);                           //
  scene.put({MarkerKind::ball, 13, 0, 0}, {-30, -6.5, -30}, up, 2500);  // balls of another size
  scene.put({MarkerKind::ball, 4, 0, 0}, {-30, -2, 10}, up, 2500);      //
  scene.put({MarkerKind::ring, 15, 5, 0}, {30, -2.5, -25}, up, 2500);   // markers of another kind
  scene.put({MarkerKind::cylinder, 8, 4, 8}, {30, -4, 30}, Vector3d::UnitY(), 2500);
  const Vector3d cube(0, 25, 0);
  scene.fill(
      cube, 8, [&](const Vector3d& p) { return (p - cube).cwiseAbs().maxCoeff() - 5; }, 1500);
  scene.noise(25, 9);
  const FoundMarkers found = find_markers(scene.ct, {ball, std::nullopt});
  ASSERT_EQ(found.markers.size(), 1U);
  EXPECT_LT(scene.off_voxels(found.markers[0].centre_in_patient_mm, {0.3, -4, 1.2}), 0.2);
  EXPECT_TRUE(found.doubtful.empty());
  EXPECT_GE(found.passed_over, 1);
  const FoundMarkers rings = find_markers(scene.ct, {{MarkerKind::ring, 15, 5, 0}, std::nullopt});
  ASSERT_EQ(rings.markers.size(), 1U);
  EXPECT_LT(scene.off_voxels(rings.markers[0].centre_in_patient_mm, {30, -2.5, -25}), 0.2);
}

TEST(Markers, WhatTheBorderCutsOrAnotherTouchesIsNamed) {
  for (const Vector3d& spacing : kSpacings) {
    SCOPED_TRACE(::testing::Message() << spacing.transpose());
    Scene scene(spacing);
    const Vector3d up = Vector3d::UnitZ();
    const MarkerShape ball{MarkerKind::ball, 8, 0, 0};
    const double top = (scene.ct.patient_from_voxel * Vector3d(0, 0, scene.ct.size[2] - 0.5)).z();
    scene.put(ball, {0, -4, 0}, up, 2500);
    scene.put(ball, {-30, -4, top - 1}, up, 2500);   // less than half of it outside
    scene.put(ball, {30, -4, top + 0.5}, up, 2500);  // more than half
    scene.put(ball, {-30, -4, -20}, up, 2500);       // two that touch
    scene.put(ball, {-22.2, -4, -20}, up, 2500);
    scene.noise(25, 2);
    const FoundMarkers found = find_markers(scene.ct, {ball, std::nullopt});
    EXPECT_EQ(found.markers.size(), 1U);
    int cut = 0;
    int touching = 0;
    for (const DoubtfulMarker& d : found.doubtful) {
      cut += d.reason.find("cut by the border") != std::string::npos ? 1 : 0;
      touching += d.reason.find("touches another") != std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(cut, 2);
    EXPECT_EQ(touching, 2);
  }
}

TEST(Markers, FilesAreReadWhileTheyAreLookedFor) {
  const birdseye::testing::Scratch scratch;
  const std::string file = birdseye::testing::small_ct(scratch);
  const Scene scene(Vector3d(0.5, 0.5, 0.5));
  std::atomic<bool> done = false;
  std::jthread looking([&] {
    while (!done) (void)find_markers(scene.ct, {});
  });
  // A copy of the process inherits what the thread held at that moment, and would wait for it for ever.
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(import_volume(file));
  done = true;
}

TEST(Markers, TheSizeOfMostOfThemIsToldWhereTheStatedOneIsWrong) {
  Scene scene({0.8, 0.8, 1});
  const MarkerShape small{MarkerKind::ball, 4, 0, 0};
  for (const double x : {-40.0, -20.0, 0.0, 20.0, 40.0})
    scene.put(small, {x + 0.3, -3 - 0.02 * x, 0.4 * x}, Vector3d::UnitZ(), 2500);
  scene.put({MarkerKind::ball, 12, 0, 0}, {0, 20, 30}, Vector3d::UnitZ(), 1200);  // one thing of another size
  scene.noise(25, 5);
  for (const double stated_mm : {2.0, 8.0, 10.0, 16.0}) {
    const MarkerSearch search{{MarkerKind::ball, stated_mm, 0, 0}, std::nullopt};
    EXPECT_LT(find_markers(scene.ct, search).markers.size(), 3U) << stated_mm;
    const auto other = other_size(scene.ct, search);
    ASSERT_TRUE(other) << stated_mm;
    EXPECT_EQ(other->count, 5) << stated_mm;
    EXPECT_NEAR(other->diameter_mm, 4, 0.4) << stated_mm;
  }
  EXPECT_FALSE(other_size(scene.ct, {small, std::nullopt})) << "the stated size is no other, and one thing tells none";
}

TEST(Markers, SizesThatNoMarkerHasAreRefused) {
  EXPECT_TRUE(check({MarkerKind::ball, 8, 0, 0}));
  EXPECT_FALSE(check({MarkerKind::ball, 0, 0, 0}));
  EXPECT_FALSE(check({MarkerKind::ball, NAN, 0, 0}));
  EXPECT_FALSE(check({MarkerKind::ring, 15, 15, 0}));
  EXPECT_FALSE(check({MarkerKind::ring, 15, 0, 0}));
  EXPECT_FALSE(check({MarkerKind::cylinder, 15, 5, 0}));
  EXPECT_TRUE(check({MarkerKind::cylinder, 15, 5, 3}));
}

}  // namespace
}  // namespace birdseye::host
