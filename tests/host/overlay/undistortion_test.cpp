#include "host/overlay/undistortion.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/geometry/lens_fold.hpp"
#include "tests/support/data.hpp"
#include "tests/support/strong_lens.hpp"
#include "tests/support/undistorted_by_opencv.hpp"

namespace birdseye::host {
namespace {

using testing::folding_lens;
using testing::smooth_frame;
using testing::strong_lens;
using testing::within;

TEST(PinholeFor, KeepsTheCentresScaleOrEveryPixel) {
  const CameraModel lens = strong_lens();
  const CameraModel scale = pinhole_for(lens, Kept::centre_scale);
  const Eigen::Vector3d axis(0, 0, 50), beside(0.01, 0.02, 50);
  EXPECT_LT(
      ((*project(scale, beside) - *project(scale, axis)) - (*project(lens, beside) - *project(lens, axis))).norm(),
      1e-6);
  const CameraModel whole = pinhole_for(lens, Kept::every_pixel);
  EXPECT_NEAR(whole.fy_px / whole.fx_px, lens.fy_px / lens.fx_px, 1e-12);
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int y = 0; y < lens.height_px; ++y) {
    for (int x = 0; x < lens.width_px; ++x) {
      const auto at = project(whole, *unproject(lens, Eigen::Vector2d(x, y)));
      low = low.cwiseMin(*at);
      high = high.cwiseMax(*at);
    }
  }
  const Eigen::Vector2d last(lens.width_px - 1, lens.height_px - 1);
  EXPECT_GT(low.minCoeff(), -1e-6);
  EXPECT_LT((high - last).maxCoeff(), 1e-6);
  EXPECT_NEAR((high - low - last).maxCoeff(), 0, 1e-6);  // one axis is filled
  EXPECT_LT(((high + low) - last).norm(), 1e-6);         // the other in the middle
}

TEST(FrameUndistorter, LeavesAPinholesFramesAsTheyAre) {
  const CameraModel pinhole = pinhole_for(strong_lens(), Kept::centre_scale);
  const std::vector<std::uint8_t> frame = smooth_frame(pinhole);
  EXPECT_EQ(FrameUndistorter(pinhole, pinhole).apply(frame), frame);
}

TEST(FrameUndistorter, HidesTheOverlayWhereThereIsNoVideo) {
  const CameraModel lens = strong_lens();
  const std::vector<std::uint8_t> white(static_cast<std::size_t>(3 * lens.width_px * lens.height_px), 255);
  for (const Kept kept : {Kept::centre_scale, Kept::every_pixel}) {
    const FrameUndistorter straighten(lens, pinhole_for(lens, kept));
    const std::vector<std::uint8_t> lit = straighten.apply(white);
    ImageRgba overlay{lens.width_px, lens.height_px, std::vector<std::uint8_t>(white.size() / 3 * 4, 99)};
    straighten.hide_unseen(overlay);
    int hidden = 0;
    for (std::size_t i = 0; i < white.size() / 3; ++i) {
      hidden += overlay.rgba[4 * i + 3] == 0 ? 1 : 0;
      if (lit[3 * i] == 255) {
        EXPECT_EQ(overlay.rgba[4 * i], 99);
      }
      if (lit[3 * i] == 0) {
        EXPECT_EQ(overlay.rgba[4 * i], 0);
      }
    }
    EXPECT_EQ(hidden > 5'000, kept == Kept::every_pixel) << hidden;
  }
}

TEST(FrameUndistorter, GivesBlackForFramesOfAnotherCamera) {
  const CameraModel lens = strong_lens();
  const FrameUndistorter straighten(lens, pinhole_for(lens, Kept::centre_scale));
  const std::vector<std::uint8_t> out = straighten.apply(std::vector<std::uint8_t>(300, 200));
  EXPECT_EQ(out, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * lens.width_px * lens.height_px)));
}

TEST(FrameUndistorter, ShowsNoRayTwiceWhereTheLensFolds) {
  const CameraModel lens = folding_lens();
  const double fold = fold_radius(lens);
  EXPECT_NEAR(fold, std::sqrt(1 / 1.2), 1e-6);  // 1 - 3 * 0.4 r^2 = 0
  CameraModel wide = pinhole_for(lens, Kept::centre_scale);
  wide.fx_px = wide.fy_px = 60;  // sees far beyond the fold
  const FrameUndistorter straighten(lens, wide);
  const auto out = straighten.apply(
      std::vector<std::uint8_t>(static_cast<std::size_t>(3 * lens.width_px * lens.height_px), std::uint8_t{200}));
  int beyond = 0, lit_beyond = 0, dark_within = 0;
  for (int y = 0; y < wide.height_px; ++y) {
    for (int x = 0; x < wide.width_px; ++x) {
      const Eigen::Vector3d ray = *unproject(wide, Eigen::Vector2d(x, y));
      const auto pixel = project(lens, ray);
      const int value = out[3 * static_cast<std::size_t>(y * wide.width_px + x)];
      if (ray.head<2>().norm() > fold) {
        beyond += within(lens, *pixel, 1) ? 1 : 0;
        lit_beyond += value > 0 ? 1 : 0;
      } else if (within(lens, *pixel, 1)) {
        dark_within += value < 200 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(beyond, 1000);
  EXPECT_EQ(lit_beyond, 0);
  EXPECT_EQ(dark_within, 0);
}

/// How far the columns' centres of a dark line lie from the straight line through them, worst, px.
double bow_px(const std::vector<std::uint8_t>& rgb, const CameraModel& c) {
  std::vector<Eigen::Vector2d> middles;
  for (int x = 10; x < c.width_px - 10; ++x) {
    double sum = 0, weight = 0;
    for (int y = 0; y < c.height_px; ++y) {
      const double dark = rgb[3 * static_cast<std::size_t>(y * c.width_px + x)];
      sum += dark * y;
      weight += dark;
    }
    if (weight > 0) middles.emplace_back(x, sum / weight);
  }
  EXPECT_GT(middles.size(), 200U);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& m : middles) {
    const Eigen::Vector2d row(m.x(), 1);
    normal += row * row.transpose();
    right += row * m.y();
  }
  const Eigen::Vector2d line = normal.inverse() * right;
  double worst = 0;
  for (const Eigen::Vector2d& m : middles) worst = std::max(worst, std::abs(line.x() * m.x() + line.y() - m.y()));
  return worst;
}

TEST(FrameUndistorter, MakesStraightLinesStraight) {
  const CameraModel lens = strong_lens();
  const FrameUndistorter straighten(lens, pinhole_for(lens, Kept::centre_scale));
  for (const double height : {-0.30, 0.05, 0.28}) {
    // A bright bar across the view, soft at its edges, as the lens shows it.
    std::vector<std::uint8_t> frame;
    for (int y = 0; y < lens.height_px; ++y) {
      for (int x = 0; x < lens.width_px; ++x) {
        const Eigen::Vector3d ray = *unproject(lens, Eigen::Vector2d(x, y));
        const double off = (ray.y() - height - 0.06 * ray.x()) / 0.008;
        frame.insert(frame.end(), 3, static_cast<std::uint8_t>(std::lround(250 * std::exp(-off * off))));
      }
    }
    const std::vector<std::uint8_t> straight = straighten.apply(frame);
    EXPECT_LT(bow_px(straight, straighten.to()), 0.1) << height;
    if (std::abs(height) > 0.1) {
      EXPECT_GT(bow_px(frame, lens), 3) << height;
    }
  }
}

TEST(FrameUndistorter, AgreesWithFramesThatOpenCvUndistorted) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  for (const std::string side : {"left", "right"}) {
    const auto [c, picture, expected] = testing::undistorted_by_opencv(*data, side, cv::IMREAD_COLOR);
    ASSERT_FALSE(picture.empty() || expected.empty());
    const FrameUndistorter straighten(c, pinhole_for(c, Kept::centre_scale));
    std::vector<std::uint8_t> straight = straighten.apply({picture.data, picture.total() * 3});
    const cv::Mat ours(picture.rows, picture.cols, CV_8UC3, straight.data());
    // The file's README: OpenCV itself differs by 0.097 and 9 at most (left), 0.061 and 5, from how the JPEG is read.
    EXPECT_LT(cv::norm(ours, expected, cv::NORM_L1) / static_cast<double>(3 * picture.total()), 0.12) << side;
    EXPECT_LE(cv::norm(ours, expected, cv::NORM_INF), 12) << side;
  }
}

/// How far a chessboard's corners lie from those of a plane seen through a lens without distortion, px RMS; less than
/// nothing where no board is found. rgb: of the camera's size.
double bent_px(const CameraModel& c, std::vector<std::uint8_t> rgb) {
  const cv::Mat picture(c.height_px, c.width_px, CV_8UC3, rgb.data());
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_RGB2GRAY);
  std::vector<cv::Point2f> corners, board, straight;
  if (!cv::findChessboardCornersSB(grey, {13, 8}, corners)) return -1;
  for (int i = 0; i < 13 * 8; ++i) board.emplace_back(static_cast<float>(i % 13), static_cast<float>(i / 13));
  cv::perspectiveTransform(board, straight, cv::findHomography(board, corners));
  return cv::norm(corners, straight) / std::sqrt(13 * 8.0);
}

TEST(FrameUndistorter, StraightensTheBoardThatALaparoscopeSaw) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "laparoscope_charuco_handeye";
  std::ifstream file(folder / "calib.left.intrinsics.txt");
  double n[14];
  for (double& value : n) file >> value;
  ASSERT_TRUE(file);
  CameraModel lens;
  lens.width_px = 1920;
  lens.height_px = 1080;
  lens.fx_px = n[0];
  lens.cx_px = n[2];
  lens.fy_px = n[4];
  lens.cy_px = n[5];
  lens.k1 = n[9];
  lens.k2 = n[10];
  lens.p1 = n[11];
  lens.p2 = n[12];
  lens.k3 = n[13];
  const FrameUndistorter straighten(lens, pinhole_for(lens, Kept::centre_scale));
  int found = 0;
  for (const char* const view : {"0", "3", "7"}) {
    const cv::Mat picture = cv::imread(folder / ("calib.left.images." + std::string(view) + ".png"), cv::IMREAD_COLOR);
    ASSERT_FALSE(picture.empty());
    const std::vector<std::uint8_t> frame(picture.data, picture.data + 3 * picture.total());
    const double before_px = bent_px(lens, frame), after_px = bent_px(straighten.to(), straighten.apply(frame));
    if (before_px < 0 || after_px < 0) continue;
    ++found;
    // The board lies near the picture's middle, and its corners are found to a quarter of a pixel.
    EXPECT_LT(after_px, 0.8 * before_px) << view;
    EXPECT_LT(after_px, 0.35) << view;
    RecordProperty(std::string("view_") + view, fmt::format("{:.2f} -> {:.2f} px", before_px, after_px));
  }
  EXPECT_EQ(found, 3);
}

}  // namespace
}  // namespace birdseye::host
