#include "host/files/camera_files.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "calibration/geometry/rotations.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;
using testing::Scratch;

const CameraModel kLens{1920, 1080, 1234.5678901234567, 1233.25, 955.125, 540.75, -0.31, 0.105, 0.0011, -0.00052, 0.02};

CameraModel without_k3() {
  CameraModel out = kLens;
  out.k3 = 0;
  return out;
}

Result<CameraModel> read_lens_text(const std::string& text, const std::string& camera = {}) {
  const Scratch scratch;
  return read_camera(scratch.file("lens.yaml", text) + camera);
}

TEST(CameraFiles, WhatIsWrittenIsReadBackExactly) {
  EXPECT_EQ(*read_lens_text(camera_text(kLens)), kLens);
  EXPECT_EQ(*read_lens_text(ros_camera_text(kLens, "scope: \"left\" #1")), kLens);
  const auto kalibr = kalibr_text(without_k3());
  ASSERT_TRUE(kalibr);
  EXPECT_EQ(*read_lens_text(*kalibr), without_k3());
  const auto none = kalibr_text(kLens);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().what, HasSubstr("k3 = 0.02"));
}

TEST(CameraFiles, APairOfKalibrIsReadCameraByCameraAndInMm) {
  CameraModel right = without_k3();
  right.fx_px = 1200;
  const Transform<RightCamera, Camera> right_from_left(rotation_exp({0.01, -0.03, 0.002}),
                                                       Eigen::Vector3d(-4.4, 0.1, 0.05));
  const Scratch scratch;
  const std::string path = scratch.file("chain.yaml", *kalibr_text(without_k3(), right, right_from_left));
  EXPECT_EQ(*read_camera(path + ":cam0"), without_k3());
  EXPECT_EQ(*read_camera(path + ":cam1"), right);
  for (const char* camera : {"", ":cam1"}) {
    const auto relation = read_camera_relation(path + camera);
    ASSERT_TRUE(relation) << relation.error().what;
    EXPECT_LT((*relation - right_from_left.matrix()).norm(), 1e-12);
  }
  const auto which = read_camera(path);
  ASSERT_FALSE(which);
  EXPECT_THAT(which.error().what, HasSubstr("say which of its cameras; it holds cam0, cam1"));
  EXPECT_THAT(read_camera(path + ":cam7").error().what, HasSubstr("has no camera cam7"));
  EXPECT_THAT(read_camera_relation(path + ":cam0").error().what, HasSubstr("lacks T_cn_cnm1"));
}

TEST(CameraFiles, ARegionOfInterestIsRefusedUnlessItIsAll) {
  const std::string ros = ros_camera_text(kLens, "scope");
  const auto with_roi = [&](const std::string& roi) { return read_lens_text(ros + "roi: " + roi + "\n"); };
  EXPECT_EQ(*with_roi("{x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}"), kLens);
  EXPECT_EQ(*with_roi("{x_offset: 0, y_offset: 0, height: 1080, width: 1920, do_rectify: false}"), kLens);
  const auto part = with_roi("{x_offset: 200, y_offset: 100, height: 800, width: 1000, do_rectify: false}");
  ASSERT_FALSE(part);
  EXPECT_THAT(part.error().what, HasSubstr("its roi is a part of the picture (1000x800 px from 200, 100)"));
  EXPECT_THAT(part.error().what, HasSubstr("cx less 200 and cy less 100"));
}

TEST(CameraFiles, ACalibrationRecordIsToldFromALens) {
  const Scratch scratch;
  const std::string path =
      scratch.file("scope.json", calibration::record_text(testing::example_record(1920, 1080, {}, {})));
  const auto camera = read_camera(path);
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().what, HasSubstr("is a calibration record; `birdseye export lens --record " + path));
}

/// Without the refusal OpenCV asks for 85 GB, which ends the program under AddressSanitizer.
TEST(CameraFiles, AMatrixOfMoreNumbersThanAreThereIsRefused) {
  std::string text = camera_text(kLens);
  const auto rows = text.find("rows: 1");
  ASSERT_NE(rows, std::string::npos);
  text.replace(rows, 7, "rows: 2147483646");
  const auto camera = read_lens_text(text);
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().what, HasSubstr("is no camera file"));
}

/// A chain as Kalibr writes it, of the EuRoC data set's kind.
const std::string kChain =
    "cam0:\n  T_cam_imu:\n  - [0.01, -0.99, 0.004, 0.02]\n  - [0.99, 0.01, 0.02, -0.06]\n"
    "  - [-0.02, 0.003, 0.99, 0.009]\n  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: []\n  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n  distortion_model: radtan\n"
    "  intrinsics: [458.654, 457.296, 367.215, 248.375]\n  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n"
    "  timeshift_cam_imu: 0.002\n";
const std::string kRos =
    "# from a calibrator\r\nimage_width: 752\r\nimage_height: 480\r\ncamera_name: narrow_stereo/left\r\n"
    "camera_matrix:\r\n  rows: 3\r\n  cols: 3\r\n  data: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]\r\n"
    "distortion_model: plumb_bob\r\ndistortion_coefficients:\r\n  rows: 1\r\n  cols: 5\r\n"
    "  data: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0]\r\n";
const std::string kMessage =
    "header:\n  seq: 1\n  frame_id: left\nheight: 480\nwidth: 752\ndistortion_model: rational_polynomial\n"
    "d: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0, 0.0, 0.0, 0.0]\n"
    "k: [458.654, 0.0, 367.215, 0.0, 457.296, 248.375, 0.0, 0.0, 1.0]\nbinning_x: 0\n---\n";

TEST(CameraFiles, FilesOfOtherProgramsProjectAsOpenCvDoes) {
  const cv::Mat k = (cv::Mat_<double>(3, 3) << 458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1);
  const cv::Mat d = (cv::Mat_<double>(1, 4) << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05);
  const std::vector<cv::Point3d> places{{10, -20, 100}, {-35, 12, 90}, {0, 0, 50}, {30, 25, 120}};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(places, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), k, d, pixels);
  for (const std::string& text : {kChain, kRos, kMessage}) {
    const auto camera = read_lens_text(text);
    ASSERT_TRUE(camera) << camera.error().what;
    EXPECT_EQ(camera->width_px, 752);
    EXPECT_EQ(camera->height_px, 480);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto pixel = project(*camera, Eigen::Vector3d(places[i].x, places[i].y, places[i].z));
      ASSERT_TRUE(pixel);
      EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-9);
      EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-9);
    }
  }
}

std::string changed(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

TEST(CameraFiles, ALensWithoutItsDistortionIsRefusedByTheKeyThatIsMissing) {
  const std::string opencv = camera_text(kLens);
  const std::string model = "distortion_model: plumb_bob\r\n";
  for (const auto& [text, key] :
       {std::pair{opencv.substr(0, opencv.find("distortion_coefficients")), "lacks distortion_coefficients;"},
        {kRos.substr(0, kRos.find("distortion_coefficients")), "lacks distortion_coefficients;"},
        {changed(kRos, model, ""), "lacks distortion_model;"},
        {changed(kChain, "  distortion_model: radtan\n", ""), "lacks distortion_model;"},
        {changed(kChain, "distortion_coeffs", "distortion"), "lacks distortion_coeffs;"}}) {
    const auto camera = read_lens_text(text);
    ASSERT_FALSE(camera) << text;
    EXPECT_THAT(camera.error().what, HasSubstr(key));
    EXPECT_THAT(camera.error().what, HasSubstr("lens.yaml: "));
  }
  const std::string terms = "[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05";
  for (const std::string& text :
       {changed(kChain, "radtan", "none"), changed(kRos, terms + ", 0]", "[]"), changed(kRos, terms, "[0, 0, 0, 0"),
        changed(kMessage, terms + ", 0.0, 0.0, 0.0, 0.0]", "[]")}) {
    const auto camera = read_lens_text(text);
    ASSERT_TRUE(camera) << camera.error().what;
    EXPECT_EQ(camera->k1, 0);
    EXPECT_EQ(camera->fx_px, 458.654);
  }
}

TEST(CameraFiles, AKeyThatStandsTwiceIsRefused) {
  const std::string matrix = "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n";
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n<image_width>320</image_width>\n"
      "<image_height>480</image_height>\n</opencv_storage>\n";
  for (const auto& [text, key] :
       {std::pair{camera_text(kLens) + matrix + "   data: [ 900., 0., 9., 0., 900., 9., 0., 0., 1. ]\n",
                  "camera_matrix"},
        {changed(camera_text(kLens), "   rows: 3\n", "   rows: 3\n   rows: 9\n"), "rows"},
        {xml, "image_width"},
        {kRos + "camera_matrix:\n  data: [900, 0, 9, 0, 900, 9, 0, 0, 1]\n", "camera_matrix"},
        {kChain + "  distortion_model: none\n", "distortion_model"},
        {kChain + kChain, "cam0"}}) {
    const auto camera = read_lens_text(text);
    ASSERT_FALSE(camera) << text;
    EXPECT_THAT(camera.error().what, HasSubstr("lens.yaml: has " + std::string(key) + " twice;"));
  }
}

TEST(CameraFiles, OneThingUnderTwoNamesIsRefusedUnlessTheyAgree) {
  const std::string k = "K: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]\n";
  const auto alike = read_lens_text(kRos + "width: 752\nheight: 480\n" + k);
  ASSERT_TRUE(alike) << alike.error().what;
  for (const auto& [more, keys] : {std::pair{std::string("width: 640\n"), "image_width and width;"},
                                   {std::string("height: 640\n"), "image_height and height;"},
                                   {changed(k, "458.654", "358.654"), "camera_matrix and K;"},
                                   {std::string("d: [0, 0, 0, 0, 0]\n"), "distortion_coefficients and d;"}}) {
    const auto camera = read_lens_text(kRos + more);
    ASSERT_FALSE(camera) << more;
    EXPECT_THAT(camera.error().what, HasSubstr("lens.yaml: says one thing twice, differently: " + std::string(keys)));
  }
  const auto two = read_lens_text(kMessage + changed(kMessage, "width: 752", "width: 640"));
  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().what, HasSubstr("lens.yaml: holds several documents (---)"));
}

/// Found by damaged inputs: yaml-cpp reads such a text for ever, and keeps each document that it makes of the same
/// piece.
TEST(CameraFiles, ATextWhoseDocumentsHaveNoEndIsRefused) {
  const Scratch scratch;
  const std::string endless = ",am0:\ncam0amer%.\nim\x01" + std::string(1, '\0') + "eimage_ha_";
  const auto camera = read_camera(scratch.file("lens.yaml", endless));
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().what, HasSubstr("holds several documents"));
}

/// yaml-cpp and OpenCV count it by eights: 064 is 52.
TEST(CameraFiles, AWholeNumberIsDecimal) {
  for (const std::string& text : {changed(kRos, "752", "0752"), changed(kMessage, "752", "0752"),
                                  changed(kChain, "[752, 480]", "[0752, 0480]")}) {
    const auto camera = read_lens_text(text);
    ASSERT_TRUE(camera) << camera.error().what;
    EXPECT_EQ(camera->width_px, 752);
    EXPECT_EQ(camera->height_px, 480);
  }
  const auto opencv = read_lens_text(changed(camera_text(kLens), "image_width: 1920", "image_width: 01720"));
  ASSERT_FALSE(opencv);
  EXPECT_THAT(opencv.error().what, HasSubstr("lens.yaml: has a picture of 01720 px; write the number without the 0"));
  const auto with_width = [](const std::string& line) {
    return read_lens_text(changed(camera_text(kLens), "image_width: 1920", line));
  };
  for (const char* line : {"image_width: !!int 01720", "image_width : 01720", "image_width: # of the lens\n   01720"}) {
    const auto octal = with_width(line);
    ASSERT_FALSE(octal) << line;
    EXPECT_THAT(octal.error().what, HasSubstr("has a picture of 01720 px")) << line;
  }
  for (const char* line : {"# image_width 01 is old\nimage_width: 1920", "   # image_width: 01\nimage_width: 1920",
                           "image_width: 1920 # image_width: 01", "note: \"#1\"\nimage_width: !!int 1920",
                           "old_image_width: 01\nimage_width: 1920"}) {
    const auto sound = with_width(line);
    ASSERT_TRUE(sound) << sound.error().what;
    EXPECT_EQ(*sound, kLens) << line;
  }
  for (const char* tag :
       {"image_width", "image_width type_id=\"x\"", "image_width type_id='>'", "image_width\n id=\"1\" "}) {
    const auto xml =
        read_lens_text(fmt::format("<?xml version=\"1.0\"?>\n<opencv_storage>\n<{}>064</image_width>\n"
                                   "<image_height>480</image_height>\n</opencv_storage>\n",
                                   tag));
    ASSERT_FALSE(xml) << tag;
    EXPECT_THAT(xml.error().what, HasSubstr("lens.yaml: has a picture of 064 px")) << tag;
  }
  const auto another = read_lens_text(
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width_old>064</image_width_old>\n</opencv_storage>\n");
  ASSERT_FALSE(another);
  EXPECT_THAT(another.error().what, HasSubstr("lacks image_width"));
  const auto letters = read_lens_text(changed(kRos, "752", "752px"));
  ASSERT_FALSE(letters);
  EXPECT_THAT(letters.error().what, HasSubstr("a whole decimal number belongs there"));
}

TEST(CameraFiles, AWholeNumberThatOpenCvTakesForAnotherIsRefused) {
  const std::string text = changed(camera_text(kLens), "540.75", "18446744073709551615");
  const auto camera = read_lens_text(text);
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().what, HasSubstr("lens.yaml: has the whole number 18446744073709551615"));
  const auto wide = read_lens_text(changed(camera_text(kLens), "image_width: 1920", "image_width: 4294969216"));
  ASSERT_FALSE(wide);
  EXPECT_THAT(wide.error().what, HasSubstr("has the whole number 4294969216"));
  EXPECT_EQ(*read_lens_text(camera_text(kLens) + "serial: \"41234567890123\"\nmade: 1700000000\n"), kLens);
}

/// Its four numbers k1 k2 k3 k4 would be taken for k1 k2 p1 p2.
TEST(CameraFiles, AnotherModelOfOpenCvIsRefusedByName) {
  const std::string plain = "%YAML:1.0\n---\n";
  for (const auto& [line, words] :
       {std::pair{"fisheye_model: 1\n", "lens.yaml: its fisheye_model 1 cannot be said by a lens here; calibrate with"},
        {"xi: 1.2\n", "its xi (of an omnidirectional camera) 1.2 cannot be said"},
        {"xi: !!opencv-matrix\n   rows: 1\n   cols: 1\n   dt: d\n   data: [ 1.2 ]\n", "its xi (of an"},
        {"distortion_model: equidistant\n", "its distortion_model equidistant cannot be said"},
        {"camera_model: fisheye\n", "its camera_model fisheye cannot be said"},
        {"camera_model: 4\n", "its camera_model 4 cannot be said"}}) {
    const auto camera = read_lens_text(changed(camera_text(kLens), plain, plain + line));
    ASSERT_FALSE(camera) << line;
    EXPECT_THAT(camera.error().what, HasSubstr(words));
  }
  for (const auto& [line, words] : {std::pair{"fisheye_model: 1\r\n", "its fisheye_model 1 cannot be said"},
                                    {"xi: 1.2\r\n", "1.2 cannot be said"},
                                    {"camera_model: fisheye\r\n", "its camera_model fisheye cannot be said"}}) {
    const auto camera = read_lens_text(kRos + line);
    ASSERT_FALSE(camera) << line;
    EXPECT_THAT(camera.error().what, HasSubstr(words));
  }
  for (const char* line : {"fisheye_model: 0\n", "distortion_model: plumb_bob\n", "distortion_model: radtan\n",
                           "distortion_model: rational_polynomial\n", "camera_model: Pinhole\n"}) {
    const auto camera = read_lens_text(changed(camera_text(kLens), plain, plain + line));
    ASSERT_TRUE(camera) << line << camera.error().what;
    EXPECT_EQ(*camera, kLens) << line;
  }
}

TEST(CameraFiles, WhatCannotBeSaidIsRefusedByName) {
  for (const auto& [text, words] :
       {std::pair{changed(kChain, "radtan", "equidistant"), "its distortion_model equidistant cannot be said"},
        {changed(kChain, "pinhole", "omni"), "its camera_model omni cannot be said"},
        {changed(kChain, ", 1.76187114e-05", ""), "has not 2 numbers of resolution, 4 of intrinsics and 4"},
        {changed(kChain, "458.654", "nan"), "lens.yaml: "},
        {changed(kChain, "458.654", "many"), "is no camera file of OpenCV, ROS or Kalibr"},
        {changed(kRos, "plumb_bob", "equidistant"), "its distortion_model equidistant"},
        {changed(kRos, "image_width: 752", "image_width: -1"), "lens.yaml: "},
        {changed(kRos, "image_width: 752\r\n", ""), "lacks image_width"},
        {changed(kRos, "[458.654, 0,", "[458.654, 2,"), "has a skew"},
        {changed(kMessage, "0.0]\nk", "0.1]\nk"), "distortion coefficient 8 of 8 is 0.1"},
        {changed(kMessage, "binning_x: 0", "binning_x: 2"), "binning_x is over 1"},
        {std::string("- 1\n- 2\n"), "is no camera file"},
        {std::string(), "is no camera file"},
        {std::string("a: [1, 2\n"), "is no camera file"},
        {std::string("%YAML:1.0\n---\nimage_width: 3\n"), "lacks image_width and image_height"}}) {
    const auto camera = read_lens_text(text);
    ASSERT_FALSE(camera) << text;
    EXPECT_THAT(camera.error().what, HasSubstr(words));
    EXPECT_EQ(camera.error().what.find('\n'), std::string::npos);
  }
  EXPECT_THAT(read_camera("/no/lens.yaml").error().what, HasSubstr("no such file"));
}

}  // namespace
}  // namespace birdseye::host
