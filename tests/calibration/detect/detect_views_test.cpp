#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "calibration/detect/detect.hpp"
#include "tests/support/grey_view.hpp"
#include "tests/support/rendered_board.hpp"

namespace birdseye::calibration {
namespace {

using testing::barrel_camera;
using testing::barrel_painter;
using testing::BoardArt;
using testing::held;
using testing::Shot;
using testing::view_of;

constexpr double kRms_px = 0.1;
constexpr double kMost_px = 0.4;

struct Errors {
  double rms_px = 0, most_px = 0;
};

/// Of each point from where the camera sees the point of its id.
Errors errors_of(const PatternView& view, const Pattern& pattern, const Transform<Camera, Marker>& pose) {
  const auto points = pattern_points_mm(pattern);
  Errors errors;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const Eigen::Vector3d& expected_mm = points[static_cast<std::size_t>(view.ids[i])];
    EXPECT_EQ(view.points_in_marker_mm[i], expected_mm);
    const double off = (*project(barrel_camera(), pose * expected_mm) - view.points_px[i]).norm();
    errors.rms_px += off * off / static_cast<double>(view.ids.size());
    errors.most_px = std::max(errors.most_px, off);
  }
  errors.rms_px = std::sqrt(errors.rms_px);
  return errors;
}

struct Hold {
  Eigen::Vector3d middle_mm;
  double tilt_deg, axis_deg, turn_deg;
};

/// In the middle and towards the corners, flat and tilted up to 45 degrees, turned by every quarter and between.
const std::vector<Hold> kHolds = {
    {{0, 0, 100}, 0, 0, 0},     {{5, 2, 110}, 25, 90, 12},    {{-5, 0, 105}, 45, 0, -8},
    {{0, 3, 105}, 45, 90, 5},   {{15, 8, 130}, 35, 40, 93},   {{-18, -8, 140}, 40, 130, 30},
    {{0, 0, 105}, 20, 60, 180}, {{8, -5, 120}, 30, 200, 185}, {{-12, 10, 112}, 45, 300, -90}};

/// All holds, each whole, every point where it should be. The worst of them.
void expect_accurate(const std::string& spec, double least_share) {
  const auto pattern = parse_pattern(spec);
  ASSERT_TRUE(pattern);
  Errors worst;
  for (std::size_t i = 0; i < kHolds.size(); ++i) {
    SCOPED_TRACE(spec + " held " + std::to_string(i));
    const Hold& hold = kHolds[i];
    const auto pose = held(*pattern, hold.middle_mm, hold.tilt_deg, hold.axis_deg, hold.turn_deg);
    Shot shot;
    shot.seed = static_cast<unsigned>(i);
    const Detection seen = detect(*pattern, view_of(barrel_painter().paint(*pattern, pose, shot)), "x");
    EXPECT_TRUE(seen.view) << seen.rejected;
    if (!seen.view) continue;
    EXPECT_EQ(seen.view->name, "x");
    EXPECT_EQ(std::set<int>(seen.view->ids.begin(), seen.view->ids.end()).size(), seen.view->ids.size());
    EXPECT_GE(seen.points_seen, least_share * seen.points_of_pattern);
    const Errors errors = errors_of(*seen.view, *pattern, pose);
    EXPECT_LT(errors.rms_px, kRms_px);
    EXPECT_LT(errors.most_px, kMost_px);
    EXPECT_EQ(seen.glare, 0);
    EXPECT_FALSE(seen.motion_deg);
    worst.rms_px = std::max(worst.rms_px, errors.rms_px);
    worst.most_px = std::max(worst.most_px, errors.most_px);
  }
  ::testing::Test::RecordProperty("worst_rms_px", std::to_string(worst.rms_px));
  ::testing::Test::RecordProperty("worst_px", std::to_string(worst.most_px));
}

TEST(DetectViews, ChessboardCornersLieWhereTheCameraSeesThem) {
  expect_accurate("chessboard:11x8:6mm", 1);
}

TEST(DetectViews, CharucoCornersLieWhereTheCameraSeesThem) {
  expect_accurate("charuco:11x8:6mm:4.5mm:DICT_4X4_50", 0.9);
}

TEST(DetectViews, LegacyCharucoCornersLieWhereTheCameraSeesThem) {
  expect_accurate("charuco:11x8:6mm:4.5mm:DICT_4X4_50:legacy", 0.9);
}

TEST(DetectViews, CornersOfAnInsetLieWhereTheCameraSeesThem) {
  expect_accurate("charuco:11x8:6mm:4.5mm:DICT_4X4_50:inset=4x3:3.5mm", 0.4);  // what the inset covers is not seen
}

TEST(DetectViews, PartOfAnInsetAndOfItsBoardIsEnough) {
  const auto pattern = parse_pattern("charuco:15x11:5mm:4mm:DICT_4X4_250:inset=7x4:4mm");
  ASSERT_TRUE(pattern);
  const auto pose = held(*pattern, {2, 1, 110}, 25, 60, 10);
  cv::Mat picture = barrel_painter().paint(*pattern, pose);
  picture(cv::Rect(0, 0, picture.cols / 2, picture.rows)) = 60;  // something lies over the left half
  const Detection seen = detect(*pattern, view_of(picture), "x");
  ASSERT_TRUE(seen.view) << seen.rejected;
  EXPECT_LT(errors_of(*seen.view, *pattern, pose).most_px, kMost_px);
  const auto of_inset =
      std::count_if(seen.view->ids.begin(), seen.view->ids.end(), [](int id) { return id >= 14 * 10; });
  EXPECT_GE(of_inset, 8);
  EXPECT_LT(of_inset, 28);
}

TEST(DetectViews, AnInsetThatIsNotThereGivesNoCorners) {
  const auto board = parse_pattern("charuco:15x11:5mm:4mm:DICT_4X4_250");
  const auto with = parse_pattern("charuco:15x11:5mm:4mm:DICT_4X4_250:inset=7x4:4mm");
  const auto pose = held(*board, {0, 0, 110}, 20, 60, 10);
  const Detection seen = detect(*with, view_of(barrel_painter().paint(*board, pose)), "x");
  ASSERT_TRUE(seen.view) << seen.rejected;
  for (const int id : seen.view->ids) EXPECT_LT(id, 14 * 10);
}

TEST(DetectViews, OddRowsAreTheSameBoardInBothLayouts) {
  const auto now = parse_pattern("charuco:8x9:5mm:4mm:DICT_5X5_50");
  const auto then = parse_pattern("charuco:8x9:5mm:4mm:DICT_5X5_50:legacy");
  const auto pose = held(*now, {0, 0, 100}, 30, 45, 20);
  const cv::Mat picture = barrel_painter().paint(*now, pose);
  EXPECT_EQ(cv::norm(picture, barrel_painter().paint(*then, pose)), 0);
  const Detection first = detect(*now, view_of(picture), "");
  const Detection second = detect(*then, view_of(picture), "");
  ASSERT_TRUE(first.view && second.view);
  EXPECT_EQ(first.view->ids, second.view->ids);
}

TEST(DetectViews, DrawnBoardIsTheOneThatOpenCvDraws) {
  const auto pattern = parse_pattern("charuco:7x6:5mm:4mm:DICT_4X4_50");
  const auto board = cv::aruco::CharucoBoard::create(7, 6, 5, 4, cv::aruco::getPredefinedDictionary(0));
  constexpr int kPxPerSquare = 60;
  cv::Mat drawn;
  board->draw({7 * kPxPerSquare, 6 * kPxPerSquare}, drawn, 0, 1);
  Pattern legacy = *pattern;
  legacy.legacy = true;
  const auto share_different = [&](const BoardArt& art) {
    int different = 0;
    for (int y = 0; y < drawn.rows; ++y) {
      for (int x = 0; x < drawn.cols; ++x) {
        const double light = art.at((x + 0.5) * 5 / kPxPerSquare, (y + 0.5) * 5 / kPxPerSquare);
        different += (light > 0.5) != (drawn.at<std::uint8_t>(y, x) > 127) ? 1 : 0;
      }
    }
    return static_cast<double>(different) / static_cast<double>(drawn.total());
  };
  // Which of the two depends on OpenCV's version.
  EXPECT_LT(std::min(share_different(BoardArt(*pattern)), share_different(BoardArt(legacy))), 0.02);
}

TEST(DetectViews, UpsideDownTheBoardsThatTellItKeepTheirNumbers) {
  for (const char* spec : {"chessboard:11x8:6mm", "charuco:11x8:6mm:4.5mm:DICT_4X4_50"}) {
    const auto pattern = parse_pattern(spec);
    ASSERT_TRUE(pattern);
    EXPECT_FALSE(pattern->half_turn_ambiguous);
    for (const double turn_deg : {0.0, 180.0}) {
      const auto pose = held(*pattern, {0, 0, 105}, 20, 30, turn_deg);
      const Detection seen = detect(*pattern, view_of(barrel_painter().paint(*pattern, pose)), "");
      ASSERT_TRUE(seen.view) << spec << seen.rejected;
      const bool upright = seen.view->points_px.front().y() < seen.view->points_px.back().y();
      EXPECT_EQ(upright, turn_deg == 0);
      EXPECT_LT(errors_of(*seen.view, *pattern, pose).most_px, kMost_px) << spec << turn_deg;
    }
  }
}

TEST(DetectViews, AmbiguousBoardIsCountedUpright) {
  const auto pattern = parse_pattern("chessboard:10x8:6mm");
  ASSERT_TRUE(pattern->half_turn_ambiguous);
  for (const double turn_deg : {10.0, 190.0}) {
    const auto pose = held(*pattern, {0, 0, 105}, 20, 30, turn_deg);
    const Detection seen = detect(*pattern, view_of(barrel_painter().paint(*pattern, pose)), "");
    ASSERT_TRUE(seen.view) << seen.rejected;
    const auto told = held(*pattern, {0, 0, 105}, 20, 30, 10);
    EXPECT_LT(errors_of(*seen.view, *pattern, told).most_px, kMost_px) << turn_deg;
  }
}

TEST(DetectViews, PartOfACharucoBoardIsEnough) {
  const auto pattern = parse_pattern("charuco:20x14:6mm:4.5mm:DICT_4X4_250");
  ASSERT_TRUE(pattern);
  const auto pose = held(*pattern, {20, 15, 80}, 30, 70, 25);  // most of it lies outside
  const Detection seen = detect(*pattern, view_of(barrel_painter().paint(*pattern, pose)), "");
  ASSERT_TRUE(seen.view) << seen.rejected;
  EXPECT_GT(seen.points_seen, 30);
  EXPECT_LT(seen.points_seen, 0.9 * seen.points_of_pattern);
  const Errors errors = errors_of(*seen.view, *pattern, pose);
  EXPECT_LT(errors.rms_px, kRms_px);
  EXPECT_LT(errors.most_px, kMost_px);
}

}  // namespace
}  // namespace birdseye::calibration
