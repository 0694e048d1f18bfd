#include "host/calibrate/picture_views.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/rendered_board.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

/// A chessboard of 7x5 inner corners, straight ahead.
cv::Mat board(int width_px, int height_px) {
  constexpr int kSide_px = 40;
  cv::Mat picture(height_px, width_px, CV_8U, cv::Scalar(220));
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 8; ++column) {
      if ((column + row) % 2 == 0)
        picture(cv::Rect(60 + column * kSide_px, 60 + row * kSide_px, kSide_px, kSide_px)) = 30;
    }
  }
  cv::GaussianBlur(picture, picture, {0, 0}, 0.8);
  return picture;
}

void write(const Scratch& scratch, const std::string& name, const cv::Mat& picture) {
  ASSERT_TRUE(cv::imwrite((scratch / name).string(), picture));
}

calibration::Pattern pattern() {
  return *calibration::parse_pattern("chessboard:7x5:5mm");
}

TEST(PictureViews, AFolderIsReadByTheNumbersInItsNames) {
  const Scratch scratch;
  for (const char* name : {"view10.png", "view9.jpg", "view2.PNG", "view1.bmp"}) write(scratch, name, board(480, 400));
  std::ofstream(scratch / "notes.txt") << "not a picture";
  const auto views = read_picture_views(pattern(), {scratch.path()});
  ASSERT_TRUE(views) << views.error().what;
  std::vector<std::string> names;
  for (const auto& view : views->used) names.push_back(view.name);
  EXPECT_EQ(names, (std::vector<std::string>{"view1.bmp", "view2.PNG", "view9.jpg", "view10.png"}));
  EXPECT_EQ(views->width_px, 480);
  EXPECT_EQ(views->height_px, 400);
  EXPECT_TRUE(views->rejected.empty());
  for (const auto& view : views->used) EXPECT_EQ(view.ids.size(), 35U);
}

/// Close-ups of a board of an odd count of columns, of which most show no end of a row.
TEST(PictureViews, WhichLayoutACharucoBoardHasAllPicturesDecide) {
  const auto told = calibration::parse_pattern("charuco:19x26:5mm:4mm:DICT_4X4_250");
  const auto drawn = calibration::parse_pattern("charuco:19x26:5mm:4mm:DICT_4X4_250:legacy");
  ASSERT_TRUE(told && drawn);
  const Scratch scratch;
  const testing::BoardPainter& painter = testing::barrel_painter();
  for (int n = 0; n < 4; ++n) {
    const double aside_mm = n == 3 ? -42 : 8.0 * (n - 1);
    const auto pose = testing::held(*drawn, {aside_mm, 5.0 * n, 45}, 10 + 5 * n, 40 * n, 0);
    write(scratch, std::to_string(n) + ".png", painter.paint(*drawn, pose));
  }
  const auto views = read_picture_views(*told, {scratch.path()});
  ASSERT_TRUE(views) << views.error().what;
  EXPECT_EQ(views->used.size(), 4U);
  EXPECT_NE(views->note.find("with :legacy"), std::string::npos) << views->note;
  const auto as_drawn = read_picture_views(*drawn, {scratch.path()});
  ASSERT_TRUE(as_drawn);
  EXPECT_EQ(as_drawn->note, "");
  ASSERT_EQ(as_drawn->used.size(), views->used.size());
  for (std::size_t i = 0; i < views->used.size(); ++i) EXPECT_EQ(views->used[i].ids, as_drawn->used[i].ids);
}

TEST(PictureViews, FilesGivenInAnyOrderComeInOne) {
  const Scratch scratch;
  for (const char* name : {"3.png", "20.png"}) write(scratch, name, board(480, 400));
  const auto views = read_picture_views(pattern(), {scratch / "20.png", scratch / "3.png"});
  ASSERT_TRUE(views && views->used.size() == 2);
  EXPECT_EQ(views->used[0].name, "3.png");
}

TEST(PictureViews, TwoSizesAreAnErrorThatNamesBoth) {
  const Scratch scratch;
  write(scratch, "a1.png", board(480, 400));
  write(scratch, "a2.png", board(480, 400));
  write(scratch, "a3.png", board(640, 480));
  const auto views = read_picture_views(pattern(), {scratch.path()});
  ASSERT_FALSE(views);
  EXPECT_EQ(views.error().what, "a1.png is 480x400 px and a3.png is 640x480 px: give pictures of one camera mode");
}

TEST(PictureViews, WhatCannotBeReadOrShowsNothingIsRejectedByName) {
  const Scratch scratch;
  write(scratch, "good.png", board(480, 400));
  write(scratch, "dark.png", board(480, 400) / 20);
  std::ofstream(scratch / "broken.png") << "\x89PNG and nothing more";
  const auto views = read_picture_views(pattern(), {scratch.path()});
  ASSERT_TRUE(views) << views.error().what;
  ASSERT_EQ(views->used.size(), 1U);
  EXPECT_EQ(views->used[0].name, "good.png");
  ASSERT_EQ(views->rejected.size(), 2U);
  EXPECT_EQ(views->rejected[0].name, "broken.png");
  EXPECT_EQ(views->rejected[0].reason, "cannot be read as a picture");
  EXPECT_EQ(views->rejected[1].name, "dark.png");
  EXPECT_NE(views->rejected[1].reason.find("too dark"), std::string::npos) << views->rejected[1].reason;
}

TEST(PictureViews, NothingToReadIsAnErrorThatNamesIt) {
  const Scratch scratch;
  const auto missing = read_picture_views(pattern(), {scratch / "nowhere"});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().what.find("nowhere"), std::string::npos);
  const auto empty = read_picture_views(pattern(), {scratch.path()});
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().what.find("no pictures"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::host
