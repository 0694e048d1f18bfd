#include "host/calibrate/picture_views.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

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
  EXPECT_FALSE(views->round_field) << "no edge is seen";
}

/// The edge that most pictures show is the lens's; one that was taken through another coupler is outvoted.
TEST(PictureViews, TheRoundFieldIsThatOfMostPictures) {
  const Scratch scratch;
  for (int i = 0; i < 5; ++i) {
    cv::Mat picture = board(480, 400), field = cv::Mat::zeros(picture.size(), CV_8U);
    cv::circle(field, {238, 203}, i == 3 ? 170 : 215, 255, cv::FILLED);
    picture.setTo(6, field == 0);
    write(scratch, std::to_string(i) + ".png", picture);
  }
  const auto views = read_picture_views(pattern(), {scratch.path()});
  ASSERT_TRUE(views) << views.error().what;
  ASSERT_TRUE(views->round_field);
  EXPECT_NEAR(views->round_field->radius_px, 215, 2);
  EXPECT_LT((views->round_field->centre_px - Eigen::Vector2d(238, 203)).norm(), 3);
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

TEST(PictureViews, PortablePixmapsAndPatternsInNames) {
  const Scratch scratch;
  for (const char* name : {"left1.ppm", "left10.PGM", "left2.pgm", "right1.png"}) {
    const bool colour = std::string(name).ends_with("ppm");
    cv::Mat picture = board(480, 400);
    if (colour) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    write(scratch, name, picture);
  }
  const auto names_of = [](const Result<PictureViews>& views) {
    std::vector<std::string> names;
    for (const auto& view : views->used) names.push_back(view.name);
    return names;
  };
  const auto folder = read_picture_views(pattern(), {scratch.path()});
  ASSERT_TRUE(folder) << folder.error().what;
  EXPECT_EQ(folder->used.size(), 4U);
  EXPECT_EQ(names_of(read_picture_views(pattern(), {scratch / "left*"})),
            (std::vector<std::string>{"left1.ppm", "left2.pgm", "left10.PGM"}));
  EXPECT_EQ(names_of(read_picture_views(pattern(), {scratch / "left?.p?m"})),
            (std::vector<std::string>{"left1.ppm", "left2.pgm"}));
  const auto none = read_picture_views(pattern(), {scratch / "middle*"});
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("middle*: no file matches"), std::string::npos);
}

/// Rows of a picture in pairs, as a field of interlaced video has them.
cv::Mat squeezed(const cv::Mat& picture) {
  cv::Mat out;
  cv::resize(picture, out, {picture.cols, picture.rows / 2}, 0, 0, cv::INTER_AREA);
  return out;
}

TEST(PictureViews, PointsOfASqueezedPictureAreThoseOfThePictureAsItIs) {
  const Scratch scratch;
  write(scratch, "whole.png", board(480, 400));
  write(scratch, "field.png", squeezed(board(480, 400)));
  const auto whole = read_picture_views(pattern(), {scratch / "whole.png"});
  const auto field = read_picture_views(pattern(), {scratch / "field.png"}, 0.5);
  ASSERT_TRUE(whole && field);
  ASSERT_EQ(field->used.size(), 1U) << field->rejected[0].reason;
  EXPECT_EQ(field->height_px, 200);
  for (std::size_t i = 0; i < 35; ++i) {
    const Eigen::Vector2d p = whole->used[0].points_px[i];
    EXPECT_EQ(field->used[0].ids[i], whole->used[0].ids[i]);
    EXPECT_LT((field->used[0].points_px[i] - Eigen::Vector2d(p.x(), (p.y() + 0.5) / 2 - 0.5)).norm(), 0.05) << i;
  }
}

TEST(PictureViews, SqueezedDotsAreFoundByTheAspectOnly) {
  const Scratch scratch;
  cv::Mat dots(480, 640, CV_8U, cv::Scalar(220));
  for (int i = 0; i < 9 * 7; ++i) cv::circle(dots, {80 + 60 * (i % 9), 60 + 60 * (i / 9)}, 14, 30, cv::FILLED);
  cv::GaussianBlur(dots, dots, {0, 0}, 0.8);
  write(scratch, "field.png", squeezed(dots));
  const auto grid = *calibration::parse_pattern("dots:9x7:4mm");
  const auto field = read_picture_views(grid, {scratch / "field.png"}, 0.5);
  ASSERT_TRUE(field);
  ASSERT_EQ(field->used.size(), 1U) << field->rejected[0].reason;
  for (std::size_t i = 0; i < 63; ++i) {
    const auto& view = field->used[0];
    const Eigen::Vector2d p(80 + 60.0 * (view.ids[i] % 9), 60 + 60.0 * (view.ids[i] / 9));
    EXPECT_LT((view.points_px[i] - Eigen::Vector2d(p.x(), (p.y() + 0.5) / 2 - 0.5)).norm(), 0.05) << i;
  }
}

TEST(PictureViews, AnAspectIsANumberOrARatio) {
  EXPECT_EQ(*parse_pixel_aspect("0.5"), 0.5);
  EXPECT_EQ(*parse_pixel_aspect("1:2"), 0.5);
  EXPECT_EQ(*parse_pixel_aspect("2"), 2);
  for (const char* text : {"", "half", "1:0", "0", "-1", "nan", "0.5x", "1:2:3", "100"})
    EXPECT_FALSE(parse_pixel_aspect(text)) << text;
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
  EXPECT_EQ(views->rejected[0].reason, "cannot be read as a picture: the file is cut short");
  EXPECT_EQ(views->rejected[1].name, "dark.png");
  EXPECT_NE(views->rejected[1].reason.find("too dark"), std::string::npos) << views->rejected[1].reason;
}

TEST(PictureViews, WhereNoPictureCanBeReadEachFileIsNamedWithItsFaultInNoLibrarysWords) {
  const Scratch scratch;
  std::ofstream(scratch / "a.png") << "garbage";
  std::ofstream(scratch / "b.png");
  std::ofstream(scratch / "c.ppm") << "P3\n4 4\n255\n1 2 3";
  std::ofstream(scratch / "d.ppm") << "P6\n9000000000 4\n255\n";
  std::ofstream(scratch / "e.ppm") << "P6\n2000000 2000000\n255\n";
  std::ofstream(scratch / "f.ppm") << "P6\n640 480\n255\n123";
  ::testing::internal::CaptureStderr();
  const auto views = read_picture_views(pattern(), {scratch.path()});
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  ASSERT_FALSE(views);
  const std::string& what = views.error().what;
  for (const char* said :
       {"a.png cannot be read as a picture: the file is damaged, or no picture",
        "b.png cannot be read as a picture: the file is empty", "c.ppm", "d.ppm", "e.ppm", "nor can 1 more"}) {
    EXPECT_NE(what.find(said), std::string::npos) << what;
  }
}

TEST(PictureViews, NothingToReadIsAnErrorThatNamesIt) {
  const Scratch scratch;
  const auto missing = read_picture_views(pattern(), {scratch / "nowhere"});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().what.find("nowhere"), std::string::npos);
  const auto empty = read_picture_views(pattern(), {scratch.path()});
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().what.find("no picture in it"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::host
