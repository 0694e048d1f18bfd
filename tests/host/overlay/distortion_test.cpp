#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/overlay/frame_painter.hpp"
#include "host/overlay/undistortion.hpp"
#include "host/render/engine.hpp"
#include "tests/support/strong_lens.hpp"

namespace birdseye::host {
namespace {

using testing::folding_lens;
using testing::smooth_frame;
using testing::strong_lens;
using testing::within;

/// A slab of air across the camera's view, of 1 mm voxels, with soft balls in it on a grid of 20 mm.
struct Landmarks {
  Volume volume;
  std::vector<Eigen::Vector3d> balls_mm;
};
Landmarks landmarks() {
  Landmarks made;
  Volume& v = made.volume;
  v.size = {141, 105, 13};
  v.spacing_mm = {1, 1, 1};
  v.patient_from_voxel.setIdentity();
  v.patient_from_voxel.translation() = Eigen::Vector3d(-70, -52, -6);
  for (int y = -40; y <= 40; y += 20) {
    for (int x = -60; x <= 60; x += 20) made.balls_mm.emplace_back(x + 0.3, y - 0.4, 0.2);
  }
  v.hu.assign(grid_count(v.size), -1000);
  for (const Eigen::Vector3d& ball : made.balls_mm) {
    for (int k = 0; k < v.size[2]; ++k) {
      for (int j = 0; j < v.size[1]; ++j) {
        for (int i = 0; i < v.size[0]; ++i) {
          const double d2 = (v.patient_from_voxel * Eigen::Vector3d(i, j, k) - ball).squaredNorm();
          if (d2 > 36) continue;
          auto& hu = v.hu[v.index(i, j, k)];
          hu = static_cast<std::int16_t>(std::max<long>(hu, std::lround(-1000 + 1600 * std::exp(-d2 / 6))));
        }
      }
    }
  }
  return made;
}

TransferFunction solid() {
  return TransferFunction({{-500, {1, 0.8, 0.2}, 0}, {300, {1, 0.8, 0.2}, 0.6}});
}

/// Before the slab's middle, turned a little.
Transform<Camera, Patient> before(double distance_mm) {
  return {rotation_exp(Eigen::Vector3d(0.06, -0.08, 0.1)), Eigen::Vector3d(1, -2, distance_mm)};
}

std::vector<std::string> engines() {
  return {"cpu", "gl"};
}

/// The middle of what is drawn near a pixel, by alpha.
Eigen::Vector2d centroid_near(const ImageRgba& image, const Eigen::Vector2d& expected, int reach_px) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  const int u = static_cast<int>(std::lround(expected.x())), v = static_cast<int>(std::lround(expected.y()));
  for (int y = std::max(0, v - reach_px); y <= std::min(image.height_px - 1, v + reach_px); ++y) {
    for (int x = std::max(0, u - reach_px); x <= std::min(image.width_px - 1, u + reach_px); ++x) {
      const double alpha = image.rgba[4 * static_cast<std::size_t>(y * image.width_px + x) + 3];
      sum += alpha * Eigen::Vector2d(x, y);
      weight += alpha;
    }
  }
  return sum / weight;
}

TEST(Distortion, LandmarksAreDrawnWhereTheLensShowsThem) {
  const Landmarks made = landmarks();
  const CameraModel lens = strong_lens();
  const CameraModel pinhole = pinhole_for(lens, Kept::centre_scale);
  const Transform<Camera, Patient> pose = before(100);
  RenderSettings settings;
  settings.step_mm = 0.4;
  for (const std::string& name : engines()) {
    const auto engine = make_engine(name, made.volume, solid());
    ASSERT_TRUE(engine) << engine.error().what;
    const ImageRgba image = (*engine)->render(lens, pose, settings);
    int seen = 0;
    double worst_px = 0, most_moved_px = 0;
    for (const Eigen::Vector3d& ball : made.balls_mm) {
      const auto pixel = project(lens, pose * ball);
      ASSERT_TRUE(pixel);
      if (!within(lens, *pixel, 12)) continue;
      ++seen;
      worst_px = std::max(worst_px, (centroid_near(image, *pixel, 11) - *pixel).norm());
      most_moved_px = std::max(most_moved_px, (*project(pinhole, pose * ball) - *pixel).norm());
    }
    EXPECT_GE(seen, 30) << name;
    EXPECT_LT(worst_px, 0.25) << name;  // a ball's middle is not quite its picture's
    EXPECT_GT(most_moved_px, 20) << name;
    RecordProperty(name + "_worst_px", std::to_string(worst_px));
  }
}

TEST(Distortion, WhatTheLensDoesNotSeeStaysTransparent) {
  // The camera in the midst of a fog: every ray meets it.
  Volume fog;
  fog.size = {24, 24, 24};
  fog.spacing_mm = {5, 5, 5};
  fog.patient_from_voxel.linear() = 5 * Eigen::Matrix3d::Identity();
  fog.patient_from_voxel.translation() = Eigen::Vector3d(-57.5, -57.5, -57.5);
  fog.hu.assign(grid_count(fog.size), 300);
  const CameraModel lens = folding_lens();
  RenderSettings settings;
  settings.near_mm = 5;
  for (const std::string name : {"cpu", "gl", "slices"}) {
    const auto engine = make_engine(name, fog, solid());
    ASSERT_TRUE(engine) << engine.error().what;
    const ImageRgba image =
        (*engine)->render(lens, {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), {0, 0, 0}}, settings);
    int dark = 0, wrong = 0;
    for (int y = 0; y < lens.height_px; ++y) {
      for (int x = 0; x < lens.width_px; ++x) {
        // A pixel on either side of the fold may be either.
        const bool ray = unproject(lens, Eigen::Vector2d(x, y)).has_value();
        bool edge = false;
        for (const auto& [i, j] : {std::pair{2, 0}, {-2, 0}, {0, 2}, {0, -2}}) {
          edge = edge || unproject(lens, Eigen::Vector2d(x + i, y + j)).has_value() != ray;
        }
        if (edge) continue;
        const bool drawn = image.rgba[4 * static_cast<std::size_t>(y * lens.width_px + x) + 3] > 0;
        dark += ray ? 0 : 1;
        wrong += drawn != ray ? 1 : 0;
      }
    }
    EXPECT_GT(dark, 1000) << name;
    EXPECT_EQ(wrong, 0) << name;
  }
}

TEST(Distortion, StraightenedOverlayAgreesWithOverlayOnStraightenedFrame) {
  const Landmarks made = landmarks();
  const CameraModel lens = strong_lens();
  const std::vector<std::uint8_t> frame = smooth_frame(lens);
  OverlayLook look;
  look.render.step_mm = 0.4;
  for (const Kept kept : {Kept::centre_scale, Kept::every_pixel}) {
    const FrameUndistorter straighten(lens, pinhole_for(lens, kept));
    const std::vector<std::uint8_t> straight = straighten.apply(frame);
    for (const std::string& name : engines()) {
      const auto engine = make_engine(name, made.volume, solid());
      ASSERT_TRUE(engine) << engine.error().what;
      const auto paint = [&engine = **engine, &look](const Still& still) {
        return paint_still(still, engine, look, vouched_for({}));
      };
      const auto bent_then_straightened = straighten.apply(paint({frame, lens, before(100)}).rgb);
      const PaintedStill painted_straight = paint({straight, straighten.to(), before(100), &straighten});
      const ImageRgba& overlay = painted_straight.volume;
      const std::vector<std::uint8_t>& drawn_straight = painted_straight.rgb;
      const auto drawn_bent = paint({straight, lens, before(100)}).rgb;
      double sum = 0, wrong_lens = 0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < drawn_straight.size(); ++i) {
        if (overlay.rgba[i / 3 * 4 + 3] == 0 || straight[i] == 0) continue;  // where the lens shows the overlay
        sum += std::abs(drawn_straight[i] - bent_then_straightened[i]);
        wrong_lens += std::abs(drawn_bent[i] - bent_then_straightened[i]);
        ++count;
      }
      const auto n = static_cast<double>(count);
      EXPECT_GT(count, 10'000U) << name;
      EXPECT_LT(sum / n, 2.0) << name;
      EXPECT_GT(wrong_lens / n, 10.0) << name;  // what the comparison says of an overlay of the other lens
      RecordProperty(name + "_mean_of_255", std::to_string(sum / n));
    }
  }
}

}  // namespace
}  // namespace birdseye::host
