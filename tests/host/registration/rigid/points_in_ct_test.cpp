#include "host/registration/rigid/points_in_ct.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

using Places = std::vector<Eigen::Vector3d>;
using Indices = std::vector<std::size_t>;

/// A body of 120 x 80 mm in air, x from -180, y from -150, so that its mirror places lie in no CT.
Volume body_in_air() {
  Volume ct;
  ct.size = {60, 50, 30};
  ct.spacing_mm = {4, 4, 4};
  ct.patient_from_voxel = Eigen::Translation3d(-240, -200, 300) * Eigen::Scaling(4.0);
  ct.hu.assign(grid_count(ct.size), -1000);
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 12; j < 32; ++j) {
      for (int i = 15; i < 45; ++i) ct.hu[ct.index(i, j, k)] = 40;
    }
  }
  return ct;
}

TEST(PointsInCt, WhatLiesInTheBodyOrAtItIsInside) {
  const Volume ct = body_in_air();
  EXPECT_EQ(points_outside(ct, Places{{-120, -100, 350}, {-192, -100, 350}, {-180, -152, 300}}), Indices{});
}

TEST(PointsInCt, WhatLiesInAirOrBeyondIsNamed) {
  const Volume ct = body_in_air();
  // In the body; 1000 mm above the CT; in the air beside the body.
  const Places places{{-120, -100, 350}, {-120, -100, 1400}, {-235, -30, 350}};
  EXPECT_EQ(points_outside(ct, places), (Indices{1, 2}));
  EXPECT_FALSE(look_like_ras(ct, places));
}

TEST(PointsInCt, RasIsToldWhereTheOtherSignsBringAllInside) {
  const Volume ct = body_in_air();
  EXPECT_TRUE(look_like_ras(ct, Places{{120, 100, 350}, {170, 140, 310}}));
  EXPECT_FALSE(look_like_ras(ct, Places{{120, 100, 350}, {170, 140, 3100}}));
  EXPECT_FALSE(look_like_ras(ct, Places{{-120, -100, 350}}));
}

}  // namespace
}  // namespace birdseye::host
