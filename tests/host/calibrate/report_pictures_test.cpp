// What the pictures of calibrations show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "calibration/geometry/rotations.hpp"
#include "host/calibrate/lens_picture.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/calibrate/residual_picture.hpp"
#include "host/calibrate/station_picture.hpp"
#include "host/calibrate/tip_pictures.hpp"
#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;
using ::testing::HasSubstr;
using ::testing::Not;

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

CameraModel pinhole() {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  return camera;
}

double moved_px(const std::string& svg) {
  std::smatch found;
  return std::regex_search(svg, found, std::regex("by up to ([^ ]+) px")) ? std::stod(found[1]) : -1;
}

TEST(LensPicture, OfAPinholeMovesNothing) {
  const std::string svg = lens_picture_svg(pinhole());
  EXPECT_NEAR(moved_px(svg), 0, 1e-6);
  EXPECT_THAT(svg, Not(HasSubstr("folds")));
}

TEST(LensPicture, TellsByHowMuchACornerIsMoved) {
  CameraModel camera = pinhole();
  camera.k1 = -0.2;
  // The corner's undistorted radius r solves r (1 - 0.2 r^2) = 400 / 500.
  double r = 0.8;
  for (int i = 0; i < 100; ++i) r = 0.8 / (1 - 0.2 * r * r);
  EXPECT_NEAR(moved_px(lens_picture_svg(camera)), 500 * (r - 0.8), 0.01 * 500 * (r - 0.8));
}

TEST(LensPicture, SaysThatALensFolds) {
  CameraModel camera = pinhole();
  camera.k1 = -1.5;
  EXPECT_THAT(lens_picture_svg(camera), HasSubstr("folds where lines end"));
}

TEST(ResidualPicture, LiesOverThePicture) {
  const std::vector<PixelResidual> residuals{{{320, 470}, {0, 3}}};
  EXPECT_THAT(residual_picture_svg(residuals, 640, 480), Not(HasSubstr("<image")));
  const std::string svg = residual_picture_svg(residuals, 640, 480, 10, "data:image/png;base64,AAAA");
  EXPECT_LT(svg.find("<image href='data:image/png;base64,AAAA'"), svg.find("<path"));
  // What would lie on the scale is cut off by an inner picture of the frame's size.
  EXPECT_LT(svg.find("</svg>"), svg.find("px (drawn 10 times as long"));
}

TEST(StationPicture, NamesWhatIsOddFromAllSides) {
  std::vector<StationMark> marks;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Matrix3d turn = rotation_exp(Eigen::Vector3d(0.02 * i, 0.3, 0.1 * i));
    marks.push_back({{turn, Eigen::Vector3d(0, 0, 100)}, i == 17, std::to_string(i + 1)});
  }
  const std::string svg = station_picture_svg(marks);
  EXPECT_EQ(count_of(svg, ">18</text>"), 3U);
  EXPECT_EQ(count_of(svg, ">5</text>"), 0U) << "thirty names would hide one another";
  marks.resize(10);
  EXPECT_EQ(count_of(station_picture_svg(marks), ">5</text>"), 3U);
}

TEST(PictureOfView, IsThatOfTheOneFileWithTheName) {
  const Scratch scratch;
  const Picture grey{8, 6, std::vector<std::uint8_t>(144, 90)};
  ASSERT_TRUE(write_files({{scratch / "a.png", png_of(grey.view())}}));
  EXPECT_THAT(picture_of_view({scratch / "a.png", scratch / "b.png"}, "a.png"), HasSubstr("data:image/png;base64,"));
  EXPECT_EQ(picture_of_view({scratch / "a.png", scratch / "b.png"}, "b.png"), "") << "is gone";
  EXPECT_EQ(picture_of_view({scratch / "a.png", scratch / "other/a.png"}, "a.png"), "") << "which of the two?";
  EXPECT_EQ(picture_of_view({}, "a.png"), "");
}

/// A tip 100 mm from its sensor, which leans round about; one pose is off by 40 mm.
struct Leaning {
  std::vector<calibration::PivotPose> poses;
  calibration::Pivot pivot;
  Leaning() {
    pivot.robust.tip_in_sensor_mm = {100, 0, 0};
    pivot.robust.pivots_in_tracker_mm = {{10, 20, 30}};
    pivot.robust.rms_mm = 0.5;
    for (int i = 0; i < 20; ++i) {
      const Eigen::Matrix3d turn = rotation_exp(Eigen::Vector3d(0, 0.4 * std::sin(i), 0.4 * std::cos(i)));
      calibration::PivotPose pose;
      pose.tracker_from_sensor = {turn, Eigen::Vector3d(10, 20, 30) - turn * Eigen::Vector3d(100, 0, 0)};
      poses.push_back(pose);
      pivot.offsets_mm.emplace_back(i == 7 ? 40 : 0.5, 0, 0);
      pivot.residuals_mm.push_back(i == 7 ? 40 : 0.5);
    }
    pivot.outliers = {7};
  }
};

TEST(TipPictures, TheSensorsPlacesLieOnTheSphere) {
  const Leaning l;
  const std::string svg = tip_places_svg(l.poses, l.pivot);
  // Three panels, each with nineteen dots and one red cross, which is two lines.
  EXPECT_EQ(count_of(svg, "r='3' fill='#0072b2'"), 57U);
  EXPECT_EQ(count_of(svg, "stroke='#b3261e'"), 6U);
  std::smatch sphere;
  ASSERT_TRUE(std::regex_search(svg, sphere,
                                std::regex("<svg x='[^']*' y='[^']*' width='[^']*' height='[^']*'><circle "
                                           "cx='([^']*)' cy='[^']*' r='([^']*)'")));
  EXPECT_GT(std::stod(sphere[2]), 50);
}

TEST(TipPictures, OneWildPoseDoesNotHideTheOthers) {
  Leaning l;
  EXPECT_THAT(tip_residuals_svg(l.poses, l.pivot), HasSubstr("bars are cut above, the longest is 40 mm"));
  l.pivot.residuals_mm[7] = 1;
  EXPECT_THAT(tip_residuals_svg(l.poses, l.pivot), Not(HasSubstr("cut above")));
}

}  // namespace
}  // namespace birdseye::host
