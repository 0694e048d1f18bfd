#include "host/volume/signed_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {
namespace {

/// An oblique grid of 2 x 2 x 3 mm, and the voxels of it that lie in a ball about middle_mm.
Volume oblique_grid() {
  Volume grid;
  grid.size = {60, 56, 40};
  grid.spacing_mm = {2, 2, 3};
  grid.patient_from_voxel.linear() =
      rotation_exp(Eigen::Vector3d(0.2, -0.1, 0.3)) * Eigen::Matrix3d(grid.spacing_mm.asDiagonal());
  grid.patient_from_voxel.translation() = Eigen::Vector3d(-40, -35, -30);
  grid.hu.assign(grid_count(grid.size), 0);
  return grid;
}

std::vector<std::uint8_t> ball(const Volume& grid, const Eigen::Vector3d& middle_mm, double radius_mm) {
  std::vector<std::uint8_t> mask(grid_count(grid.size));
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const Eigen::Vector3d place_mm = grid.patient_from_voxel * Eigen::Vector3d(i, j, k);
        mask[grid.index(i, j, k)] = (place_mm - middle_mm).norm() < radius_mm ? 1 : 0;
      }
    }
  }
  return mask;
}

TEST(SignedDistance, OfABallIsTheDistanceToItsSphereWithinAPartOfAVoxel) {
  const Volume grid = oblique_grid();
  const Eigen::Vector3d middle_mm = grid.patient_from_voxel * Eigen::Vector3d(30, 28, 20);
  constexpr double kRadius_mm = 35;
  const auto distance = signed_distance_of(grid, ball(grid, middle_mm, kRadius_mm), 2, 24);
  ASSERT_TRUE(distance) << distance.error().what;
  double sum_mm = 0, squares_mm2 = 0;
  int count = 0;
  for (double height = -0.95; height < 1; height += 0.1) {
    for (double turn = 0; turn < 6.2; turn += 0.3) {
      const double aside = std::sqrt(1 - height * height);
      const Eigen::Vector3d outwards(aside * std::cos(turn), aside * std::sin(turn), height);
      const auto at = distance->sample(middle_mm + kRadius_mm * outwards);
      sum_mm += at.distance_mm;
      squares_mm2 += at.distance_mm * at.distance_mm;
      ++count;
      EXPECT_GT(at.gradient.normalized().dot(outwards), 0.95);
      EXPECT_NEAR(at.gradient.norm(), 1, 0.2);
      EXPECT_NEAR(distance->distance_mm(middle_mm + (kRadius_mm - 6) * outwards), -6, 0.8);
      EXPECT_NEAR(distance->distance_mm(middle_mm + (kRadius_mm + 6) * outwards), 6, 0.8);
    }
  }
  // Half of what a registration of an organ that did not move may leave. Smoothing draws a ball's boundary inwards, by
  // its variance over the radius.
  EXPECT_NEAR(sum_mm / count, 0, 0.15);
  EXPECT_LT(std::sqrt(squares_mm2 / count), 0.35);
}

TEST(SignedDistance, GrowsByTheWayToItsBox) {
  const Volume grid = oblique_grid();
  const Eigen::Vector3d middle_mm = grid.patient_from_voxel * Eigen::Vector3d(30, 28, 20);
  const auto distance = signed_distance_of(grid, ball(grid, middle_mm, 30), 2, 10);
  ASSERT_TRUE(distance) << distance.error().what;
  const Eigen::Vector3d corner_mm = distance->patient_from_box() * distance->box_mm();
  const Eigen::Vector3d away_mm = distance->patient_from_box().linear() * Eigen::Vector3d(3, 4, 0);
  EXPECT_NEAR(distance->distance_mm(corner_mm + away_mm), distance->distance_mm(corner_mm) + 5, 1e-6);
}

TEST(SignedDistance, GoesOnGrowingFarFromABoundaryOfASmallOrganAndOfALargeOne) {
  const Volume grid = oblique_grid();
  const Eigen::Vector3d middle_mm = grid.patient_from_voxel * Eigen::Vector3d(30, 28, 20);
  // Between every third point of a grid of 2 mm the small one is lost.
  for (const double radius_mm : {4.0, 32.0}) {
    const auto distance = signed_distance_of(grid, ball(grid, middle_mm, radius_mm), 2, 24);
    ASSERT_TRUE(distance) << distance.error().what;
    for (const Eigen::Vector3d& outwards :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-0.6, 0.8, 0), Eigen::Vector3d(0, 0.6, -0.8)}) {
      const double at_boundary_mm = distance->distance_mm(middle_mm + radius_mm * outwards);
      double before_mm = -radius_mm;
      for (double off_mm = std::max(-20.0, 2 - radius_mm); off_mm < 22; off_mm += 0.5) {
        const double found_mm = distance->distance_mm(middle_mm + (radius_mm + off_mm) * outwards);
        // Against the place at the boundary, which smoothing draws inwards. Marching is of the first order, which about
        // so small a ball as the first is 2 mm too much at 10 mm.
        EXPECT_NEAR(found_mm - at_boundary_mm, off_mm, 1 + 0.15 * std::abs(off_mm)) << radius_mm;
        EXPECT_GT(found_mm, before_mm) << radius_mm << " " << off_mm;
        before_mm = found_mm;
      }
    }
  }
}

TEST(SignedDistance, RefusesWhatHasNoBoundary) {
  const Volume grid = oblique_grid();
  for (const std::uint8_t all : {std::uint8_t{0}, std::uint8_t{1}}) {
    const auto distance = signed_distance_of(grid, std::vector<std::uint8_t>(grid_count(grid.size), all), 2, 10);
    ASSERT_FALSE(distance);
    EXPECT_EQ(distance.error().code, Errc::not_found);
  }
}

}  // namespace
}  // namespace birdseye::host
