#include "calibration/detect/detect.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/support/data.hpp"
#include "tests/support/grey_view.hpp"

namespace birdseye::calibration {
namespace {

using testing::view_of;

TEST(Pattern, ReadsItsSpecsAndRefusesNonsense) {
  EXPECT_TRUE(parse_pattern("chessboard:14x10:0.3cm")->half_turn_ambiguous);
  EXPECT_FALSE(parse_pattern("chessboard:11x8:6mm")->half_turn_ambiguous);
  EXPECT_FALSE(parse_pattern("dots:4x11:5mm:asymmetric")->half_turn_ambiguous);
  EXPECT_TRUE(parse_pattern("dots:25x18:3mm:markers=133,141,308,316")->half_turn_ambiguous);
  EXPECT_FALSE(parse_pattern("dots:25x18:3mm:markers=133,141,308,317")->half_turn_ambiguous);
  for (const char* wrong : {"chessboard",
                            "chessboard:14x10:3",
                            "chessboard:2x5:3mm",
                            "chessboard:14x10:nanmm",
                            "charuco:5x7:5mm:4mm",
                            "charuco:5x7:5mm:5mm:DICT_4X4_50",
                            "charuco:50x70:5mm:4mm:DICT_4X4_50",
                            "dots:5x5:3mm:markers=1,2,99",
                            "charuco:19x26:5mm:4mm:DICT_4X4_250:inset=8x13",
                            "charuco:19x26:5mm:4mm:DICT_4X4_250:inset=8:3mm",
                            "charuco:19x26:5mm:4mm:DICT_4X4_250:inset=8x40:3mm",
                            "charuco:19x26:5mm:4mm:DICT_4X4_250:inset=8x13:3mm:legacy",
                            "chessboard:14x10:3mm:inset=3x3:1mm",
                            "dots:19x15:2mm:bars=142",
                            "dots:19x15:2mm:bars=142-160",
                            "dots:19x15:2mm:bars=142-144",
                            "dots:19x15:2mm:bars=146-142",
                            "dots:19x15:2mm:bars=142-999",
                            "dots:19x15:2mm:asymmetric:bars=142-146",
                            "dots:19x15:2mm:bars=142-146:markers=1,2,143"})
    EXPECT_FALSE(parse_pattern(wrong)) << wrong;
  const auto inset = parse_pattern("charuco:19x26:5mm:4mm:DICT_4X4_250:legacy:inset=8x13:3mm");
  ASSERT_TRUE(inset);
  const auto points = pattern_points_mm(*inset);
  ASSERT_EQ(points.size(), 18U * 25 + 8 * 13);
  // In the middle of a board of 95 x 130 mm.
  EXPECT_LT((points[450] - Eigen::Vector3d(37, 47, 0)).norm(), 1e-12);
  EXPECT_LT((points.back() - Eigen::Vector3d(58, 83, 0)).norm(), 1e-12);
}

/// Tags round a chessboard in the middle, with the chessboard or without.
class StorzPlate : public ::testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(StorzPlate, FitsOneLens) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto& [spec, least] = GetParam();
  const auto pattern = parse_pattern(spec);
  ASSERT_TRUE(pattern);
  std::vector<std::vector<cv::Point3f>> points_mm;
  std::vector<std::vector<cv::Point2f>> points_px;
  for (const char* name : {"0", "1", "2", "3", "4", "7"}) {
    const auto file = *data / "laparoscope_charuco_handeye" / (std::string("calib.left.images.") + name + ".png");
    const cv::Mat grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    const Detection seen = detect(*pattern, view_of(grey), name);
    ASSERT_TRUE(seen.view) << seen.rejected;
    EXPECT_GE(seen.points_seen, least);
    auto& mm = points_mm.emplace_back();
    auto& px = points_px.emplace_back();
    for (const auto& p : seen.view->points_in_marker_mm) mm.emplace_back(float(p.x()), float(p.y()), 0.F);
    for (const auto& p : seen.view->points_px) px.emplace_back(float(p.x()), float(p.y()));
  }
  cv::Mat camera, distortion;
  std::vector<cv::Mat> turns, moves;
  EXPECT_LT(cv::calibrateCamera(points_mm, points_px, {1920, 1080}, camera, distortion, turns, moves), 0.9);
  for (std::size_t v = 0; v < points_mm.size(); ++v) {
    std::vector<cv::Point2f> fitted;
    cv::projectPoints(points_mm[v], turns[v], moves[v], camera, distortion, fitted);
    for (std::size_t i = 0; i < fitted.size(); ++i) EXPECT_LT(cv::norm(fitted[i] - points_px[v][i]), 5);
  }
}

INSTANTIATE_TEST_SUITE_P(Detect, StorzPlate,
                         ::testing::Values(std::pair{"charuco:19x26:5mm:4mm:DICT_4X4_250:legacy", 180},
                                           std::pair{"charuco:19x26:5mm:4mm:DICT_4X4_250:legacy:inset=8x13:3mm", 270}));

/// The words with which a real picture is rejected.
std::string why_rejected(const std::string& spec, const std::filesystem::path& file) {
  const auto pattern = parse_pattern(spec);
  EXPECT_TRUE(pattern) << spec;
  const cv::Mat grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  EXPECT_FALSE(grey.empty()) << file;
  return detect(*pattern, view_of(grey), spec).rejected;
}

TEST(Detect, WrongCountsOfRealBoardsAreToldWithThoseThatFit) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  for (const char* name : {"0", "2", "7"}) {
    const auto file = *data / "laparoscope_charuco_handeye" / (std::string("calib.left.images.") + name + ".png");
    for (const char* counts : {"18x26", "20x25", "26x19", "25x18", "26x18", "18x25"}) {
      const std::string told = why_rejected(std::string("charuco:") + counts + ":5mm:4mm:DICT_4X4_250:legacy", file);
      EXPECT_NE(told.find("as on a board of 19x"), std::string::npos) << name << " " << counts << ": " << told;
    }
  }
  const auto chessboard = *data / "camera_undistort_opencv/left01.jpg";
  EXPECT_EQ(why_rejected("chessboard:9x6:25mm", chessboard), "");
  for (const char* counts : {"10x7", "7x10"}) {
    const std::string told = why_rejected(std::string("chessboard:") + counts + ":25mm", chessboard);
    EXPECT_NE(told.find("squares were counted"), std::string::npos) << counts << ": " << told;
  }
  EXPECT_NE(why_rejected("chessboard:10x6:25mm", chessboard).find("9x6 inner corners is seen"), std::string::npos);
}

TEST(Detect, AnInsetThatIsNotThereIsSeenToBeWrong) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto file = *data / "laparoscope_charuco_handeye/calib.left.images.0.png";
  const cv::Mat grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  for (const auto& [inset, wrong] : {std::pair{"8x13:3mm", false}, {"9x14:3mm", true}, {"8x13:4mm", true}}) {
    const auto pattern = parse_pattern(std::string("charuco:19x26:5mm:4mm:DICT_4X4_250:legacy:inset=") + inset);
    ASSERT_TRUE(pattern);
    const Detection seen = detect(*pattern, view_of(grey), inset);
    EXPECT_EQ(seen.inset.is_wrong(), wrong) << inset << ": " << seen.inset.found << " of " << seen.inset.looked_for;
  }
}

TEST(Detect, WebcamCornersLieAtThePublishedOnesAndFaultsAreNamed) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto pattern = parse_pattern("chessboard:14x10:6mm");
  ASSERT_TRUE(pattern);
  cv::Mat grey;
  for (int i = 0; i < 12; ++i) {
    const auto stem = *data / "camera_chessboard_webcam" / "calib.";
    grey = cv::imread(stem.string() + "images." + std::to_string(i) + ".png", cv::IMREAD_GRAYSCALE);
    const Detection seen = detect(*pattern, view_of(grey), std::to_string(i));
    ASSERT_TRUE(seen.view) << i << ": " << seen.rejected;
    std::ifstream in(stem.string() + "image_points." + std::to_string(i) + ".txt");
    std::vector<Eigen::Vector2d> published;
    Eigen::Vector2d p;
    while (in >> p.x() >> p.y()) published.push_back(p);
    std::vector<double> apart;
    for (const auto& px : seen.view->points_px) {
      double nearest = 1e9;
      for (const auto& q : published) nearest = std::min(nearest, (px - q).norm());
      apart.push_back(nearest);
    }
    std::nth_element(apart.begin(), apart.begin() + 70, apart.end());
    EXPECT_LT(apart[70], 0.5) << i;
    RecordProperty("width_px_" + std::to_string(i), std::to_string(seen.sharpness_px));
  }
  cv::Mat bad = grey / 12;
  EXPECT_NE(detect(*pattern, view_of(bad), "").rejected.find("too dark"), std::string::npos);
  bad = grey * 10;
  EXPECT_NE(detect(*pattern, view_of(bad), "").rejected.find("overexposed"), std::string::npos);
  cv::GaussianBlur(grey, bad, {0, 0}, 12);
  EXPECT_FALSE(detect(*pattern, view_of(bad), "").view);
}

}  // namespace
}  // namespace birdseye::calibration
