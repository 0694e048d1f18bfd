#include "host/overlay/margins.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace birdseye::host {
namespace {

constexpr double kBall_mm = 12;
const Eigen::Vector3d kMiddle_mm(30, 40, 50);

/// A ball of label 7 in a grid whose axes are no patient's.
Volume ball_label() {
  Volume labels;
  labels.size = {60, 64, 50};
  labels.spacing_mm = {0.8, 0.8, 1.25};
  labels.patient_from_voxel.linear() =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() *
       labels.spacing_mm.asDiagonal());
  const Eigen::Vector3d middle_voxel(29, 31, 25);
  labels.patient_from_voxel.translation() = kMiddle_mm - labels.patient_from_voxel.linear() * middle_voxel;
  labels.hu.resize(grid_count(labels.size));
  for (int k = 0; k < labels.size[2]; ++k) {
    for (int j = 0; j < labels.size[1]; ++j) {
      for (int i = 0; i < labels.size[0]; ++i) {
        const Eigen::Vector3d place_mm = labels.patient_from_voxel * Eigen::Vector3d(i, j, k);
        if ((place_mm - kMiddle_mm).norm() < kBall_mm) labels.hu[labels.index(i, j, k)] = 7;
      }
    }
  }
  return labels;
}

const CameraModel kCamera{640, 480, 700, 700, 319.5, 239.5};

/// From so far before a place of the patient, looking at it.
Transform<Camera, Patient> before(const Eigen::Vector3d& place_mm, double away_mm) {
  return {Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, away_mm) - place_mm};
}

/// How far from the picture's middle the outermost pixel lies that is not bare.
double reach_px(const ImageRgba& picture) {
  double most = 0;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (picture.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) +
                            static_cast<std::size_t>(x)) +
                       3] != 0)
        most = std::max(most, std::hypot(x - kCamera.cx_px, y - kCamera.cy_px));
    }
  }
  return most;
}

ImageRgba drawn(const Margins& margins, const Transform<Camera, Patient>& camera_from_patient) {
  ImageRgba picture{kCamera.width_px, kCamera.height_px, std::vector<std::uint8_t>(std::size_t{4} * 640 * 480)};
  draw_margins(margins, kCamera, camera_from_patient, picture);
  return picture;
}

TEST(Margins, ReachAsFarAsTheySay) {
  constexpr double kAway_mm = 120;
  for (const double margin_mm : {2.0, 5.0, 10.0, 20.0}) {
    const auto margins = margins_about(ball_label(), std::vector<int>{7}, {margin_mm});
    ASSERT_TRUE(margins) << margins.error().what;
    // The outline of a ball lies where a ray touches it.
    const double radius_mm = kBall_mm + margin_mm;
    const double expected_px = kCamera.fx_px * radius_mm / std::sqrt(kAway_mm * kAway_mm - radius_mm * radius_mm);
    const double mm_per_px = kAway_mm / kCamera.fx_px;
    EXPECT_NEAR(reach_px(drawn(*margins, before(kMiddle_mm, kAway_mm))) * mm_per_px, expected_px * mm_per_px, 0.5)
        << margin_mm;
  }
}

TEST(Margins, AreDrawnWholeWithALineAtTheirOutline) {
  const auto margins = margins_about(ball_label(), std::vector<int>{7}, {10, 5});
  ASSERT_TRUE(margins);
  ASSERT_EQ(margins->size(), 2U);
  EXPECT_EQ(margins->front().mm, 5) << "the narrowest first";
  const ImageRgba picture = drawn(*margins, before(kMiddle_mm, 120));
  const double reach = reach_px(picture);
  int lines = 0;
  bool in_line = false;
  for (int x = 320; x < 640; ++x) {
    const std::uint8_t alpha = picture.rgba[4 * (240U * 640U + static_cast<unsigned>(x)) + 3];
    if (x - kCamera.cx_px < reach - 2) {
      EXPECT_GT(alpha, 0) << "a gap at " << x;
    }
    if (alpha == 255 && !in_line) ++lines;
    in_line = alpha == 255;
  }
  EXPECT_EQ(lines, 2);
}

TEST(Margins, MoveWithTheTissue) {
  const auto margins = margins_about(ball_label(), std::vector<int>{7}, {5});
  ASSERT_TRUE(margins);
  DisplacementField field;  // a shift of 9 mm, everywhere that is looked at
  field.size = {2, 2, 2};
  field.patient_from_lattice = Eigen::Translation3d(-500, -500, -500) * Eigen::Scaling(1000.0);
  field.displacement_mm.assign(8, Eigen::Vector3f(-9, 0, 0));
  const Eigen::Vector3d moved_mm = kMiddle_mm + Eigen::Vector3d(9, 0, 0);
  const double there = reach_px(drawn(deformed(*margins, field), before(moved_mm, 120)));
  EXPECT_NEAR(there, reach_px(drawn(*margins, before(kMiddle_mm, 120))), 1.0);
}

TEST(Margins, BehindTheLensOrInAnotherSizeAreNotDrawn) {
  const auto margins = margins_about(ball_label(), std::vector<int>{7}, {5});
  ASSERT_TRUE(margins);
  EXPECT_EQ(reach_px(drawn(*margins, before(kMiddle_mm, -120))), 0);
  ImageRgba small{64, 48, std::vector<std::uint8_t>(std::size_t{4} * 64 * 48)};
  draw_margins(*margins, kCamera, before(kMiddle_mm, 120), small);
  for (const std::uint8_t value : small.rgba) ASSERT_EQ(value, 0);
}

TEST(Margins, ThatAreNotToBeHadAreNamed) {
  const Volume labels = ball_label();
  const std::vector<int> ball{7}, none{8};
  for (const std::vector<double>& mm :
       {std::vector<double>{}, {0.0}, {5, 50}, {1, 2, 3, 4, 5}, {std::numeric_limits<double>::quiet_NaN()}}) {
    const auto margins = margins_about(labels, ball, mm);
    ASSERT_FALSE(margins);
    EXPECT_NE(margins.error().what.find("1 to 40 mm"), std::string::npos) << margins.error().what;
  }
  EXPECT_EQ(margins_about(labels, none, {5}).error().code, Errc::not_found);
}

}  // namespace
}  // namespace birdseye::host
