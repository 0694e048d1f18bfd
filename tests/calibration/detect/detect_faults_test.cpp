#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calibration/detect/detect.hpp"
#include "tests/support/grey_view.hpp"
#include "tests/support/rendered_board.hpp"

namespace birdseye::calibration {
namespace {

using testing::barrel_painter;
using testing::held;
using testing::Shot;
using testing::view_of;

constexpr const char* kChessboard = "chessboard:11x8:6mm";
constexpr const char* kCharuco = "charuco:11x8:6mm:4.5mm:DICT_4X4_50";

Pattern pattern_of(const char* spec) {
  return *parse_pattern(spec);
}

cv::Mat picture_of(const char* spec, const Shot& shot = {}, const Eigen::Vector3d& middle_mm = {0, 0, 105}) {
  const Pattern pattern = pattern_of(spec);
  return barrel_painter().paint(pattern, held(pattern, middle_mm, 15, 50, 8), shot);
}

/// OpenCV searches a large picture for ten seconds before it gives up.
cv::Mat smaller(const cv::Mat& picture) {
  cv::Mat small;
  cv::resize(picture, small, {}, 0.6, 0.6, cv::INTER_AREA);
  return small;
}

void expect_rejected(const Detection& seen, const std::vector<std::string>& words) {
  EXPECT_FALSE(seen.view);
  for (const std::string& word : words)
    EXPECT_NE(seen.rejected.find(word), std::string::npos) << "\"" << seen.rejected << "\" lacks \"" << word << '"';
}

class Faults : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] Detection look(const Shot& shot) const {
    return detect(pattern_of(GetParam()), view_of(picture_of(GetParam(), shot)), "");
  }
};

TEST_P(Faults, NoneIsFoundWhereThereIsNone) {
  const Detection seen = look({});
  EXPECT_TRUE(seen.view) << seen.rejected;
  EXPECT_TRUE(seen.rejected.empty());
  EXPECT_GT(seen.sharpness_px, 1.5);
  EXPECT_LT(seen.sharpness_px, 5);
  EXPECT_GT(seen.contrast, 80);
  EXPECT_GT(seen.area_share, 0.1);
}

TEST_P(Faults, Unlit) {
  Shot shot;
  shot.dark = 3;
  shot.light = 14;
  expect_rejected(look(shot), {"too dark", "light"});
}

TEST_P(Faults, Overexposed) {
  Shot shot;
  shot.dark = 230;
  shot.light = 900;
  expect_rejected(look(shot), {"overexposed", "% of it is saturated"});
}

TEST_P(Faults, OutOfFocus) {
  for (const double blur_px : {6.0, 9.0, 13.0}) {
    Shot shot;
    shot.blur_px = blur_px;
    const Detection seen = look(shot);
    expect_rejected(seen, {"blurred", "px wide"});
    EXPECT_FALSE(seen.motion_deg) << blur_px;
    EXPECT_GT(seen.sharpness_px, 0.6 * 2.5 * blur_px);
  }
}

TEST_P(Faults, MovedWhileTheShutterWasOpen) {
  for (const double deg : {0.0, 35.0, 90.0, -60.0}) {
    Shot shot;
    shot.motion_px = 20;
    shot.motion_deg = deg;
    const Detection seen = look(shot);
    expect_rejected(seen, {"blurred", "moved along"});
    ASSERT_TRUE(seen.motion_deg) << deg;
    // A chessboard's edges run two ways only: between them the direction is known roughly.
    EXPECT_LT(std::abs(std::remainder(*seen.motion_deg - deg, 180.0)), 25) << deg << " told as " << *seen.motion_deg;
  }
}

TEST_P(Faults, LittleBlurIsNoReason) {
  Shot shot;
  shot.blur_px = 1.6;
  const Detection seen = look(shot);
  EXPECT_TRUE(seen.view) << seen.rejected;
}

TEST(DetectFaults, SoftPictureWhoseTagsDoNotReadSaysSo) {
  Shot shot;
  shot.blur_px = 3.2;
  expect_rejected(detect(pattern_of(kCharuco), view_of(picture_of(kCharuco, shot)), ""), {"px wide"});
}

TEST_P(Faults, Glare) {
  Shot shot;
  shot.glare_radius_px = 110;
  shot.glare_px = {430, 280};
  const Detection seen = look(shot);
  expect_rejected(seen, {"glare", "tilt"});
}

TEST_P(Faults, LowContrast) {
  Shot shot;
  shot.dark = 120;
  shot.light = 130;
  shot.noise = 0.5;
  expect_rejected(look(shot), {"differ by", "grey levels only"});
}

TEST_P(Faults, TooSmallAPicture) {
  cv::Mat small;
  cv::resize(picture_of(GetParam()), small, {60, 40}, 0, 0, cv::INTER_AREA);
  expect_rejected(detect(pattern_of(GetParam()), view_of(small), ""), {"smaller than 64 px"});
  expect_rejected(detect(pattern_of(GetParam()), GreyView{}, ""), {"smaller than 64 px"});
}

INSTANTIATE_TEST_SUITE_P(Boards, Faults, ::testing::Values(kChessboard, kCharuco),
                         [](const auto& board) { return board.index == 0 ? "Chessboard" : "Charuco"; });

TEST(DetectFaults, EmptyPictureShowsNoBoard) {
  const cv::Mat empty(600, 960, CV_8U, cv::Scalar(128));
  expect_rejected(detect(pattern_of(kChessboard), view_of(empty), ""), {"no chessboard is found"});
  expect_rejected(detect(pattern_of(kCharuco), view_of(empty), ""), {"no tag"});
}

TEST(DetectFaults, ChessboardBeyondTheBorder) {
  const cv::Mat picture = smaller(picture_of(kChessboard, {}, {62, 0, 70}));
  expect_rejected(detect(pattern_of(kChessboard), view_of(picture), ""),
                  {"11x8 are expected", "part of it lies outside the picture"});
}

TEST(DetectFaults, AnotherChessboard) {
  const cv::Mat picture = smaller(picture_of("chessboard:9x6:6mm", {}, {0, 0, 110}));
  expect_rejected(detect(pattern_of(kChessboard), view_of(picture), ""),
                  {"9x6 inner corners", "11x8 are expected", "another board"});
}

TEST(DetectFaults, TooFewCharucoCorners) {
  cv::Mat picture = picture_of(kCharuco);
  picture.colRange(0, 640) = 90;
  const Detection seen = detect(pattern_of(kCharuco), view_of(picture), "");
  expect_rejected(seen, {"too few corners", "12 are needed"});
}

TEST(DetectFaults, TheOtherLayoutIsNamed) {
  const std::string legacy = std::string(kCharuco) + ":legacy";
  const cv::Mat old_board = picture_of(legacy.c_str());
  expect_rejected(detect(pattern_of(kCharuco), view_of(old_board), ""), {"old layout", "add :legacy"});
  const cv::Mat new_board = picture_of(kCharuco);
  expect_rejected(detect(pattern_of(legacy.c_str()), view_of(new_board), ""), {"new layout", "leave out :legacy"});
}

TEST(DetectFaults, MirroredPictureIsNamed) {
  cv::Mat mirrored;
  cv::flip(picture_of(kCharuco), mirrored, 1);
  expect_rejected(detect(pattern_of(kCharuco), view_of(mirrored), ""), {"mirrored"});
}

}  // namespace
}  // namespace birdseye::calibration
