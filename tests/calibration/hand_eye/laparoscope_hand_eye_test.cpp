// Hand-eye of a real laparoscope: pictures of a board that moves, both tracked optically.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/base/units.hpp"
#include "calibration/camera/camera_calibration.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "tests/support/data.hpp"

namespace birdseye::calibration {
namespace {

Eigen::Matrix4d read_matrix(const std::filesystem::path& path) {
  std::ifstream in(path);
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) in >> out(r, c);
  }
  return out;
}

using Corners = std::map<int, std::vector<cv::Point2f>>;

Corners tags_in(const std::filesystem::path& path) {
  const cv::Mat picture = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_250);
  auto how = cv::aruco::DetectorParameters::create();
  how->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(picture, dictionary, corners, ids, how);
  Corners out;
  for (std::size_t i = 0; i < ids.size(); ++i) out[ids[i]] = corners[i];
  return out;
}

/// Corners of the plate's tags, whose places are those in the picture that it was printed from, 10 px to a mm.
PatternView seen_tags(const std::filesystem::path& path, const Corners& printed) {
  constexpr double kMmPerPx = 0.1;
  PatternView out;
  out.name = path.filename().string();
  for (const auto& [id, corners] : tags_in(path)) {
    const auto there = printed.find(id);
    if (there == printed.end()) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      out.ids.push_back(4 * id + static_cast<int>(i));
      out.points_in_marker_mm.emplace_back(kMmPerPx * there->second[i].x, kMmPerPx * there->second[i].y, 0);
      out.points_px.emplace_back(corners[i].x, corners[i].y);
    }
  }
  return out;
}

TEST(LaparoscopeHandEye, IsThePublishedOne) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "laparoscope_charuco_handeye";
  const Corners printed = tags_in(folder / "pattern_4x4_19x26_5_4_with_inset_9x14.png");
  HandEyeInput input;
  for (const char* number : {"0", "1", "2", "3", "4", "7"}) {
    const std::string n = number;
    HandEyeStation s;
    s.view = seen_tags(folder / ("calib.left.images." + n + ".png"), printed);
    s.name = s.view.name;
    s.tracker_from_sensor =
        Transform<Tracker, Sensor>::from_matrix(read_matrix(folder / ("calib.device_tracking." + n + ".txt")));
    s.tracker_from_body =
        Transform<Tracker, TrackedBody>::from_matrix(read_matrix(folder / ("calib.calib_obj_tracking." + n + ".txt")));
    input.stations.push_back(s);
  }

  // The lens from the same views, with all five terms, as the README's own check has it.
  std::vector<PatternView> views;
  for (const HandEyeStation& s : input.stations) views.push_back(s.view);
  CameraCalibrationSettings settings;
  settings.model = LensModel::radial3_tangential2;
  settings.robust = false;
  const auto lens = calibrate_camera(views, 1920, 1080, settings);
  ASSERT_TRUE(lens) << lens.error().what;
  input.camera = lens->camera;
  // What optical trackers of the kind state. With six stations their own residuals hardly tell it.
  input.tracker_noise = TrackerNoise{0.25, 0.1 * kRadPerDeg};
  const auto result = calibrate_hand_eye(input);
  ASSERT_TRUE(result && result->solved);
  const auto published = Transform<Camera, Sensor>::from_matrix(read_matrix(folder / "calib.left.handeye.txt"));
  const Eigen::Vector3d off_mm = result->camera_from_sensor.translation() - published.translation();
  const double off_deg =
      rotation_angle_between(result->camera_from_sensor.rotation(), published.rotation()) * kDegPerRad;
  EXPECT_LT(off_mm.norm(), 1.5);
  EXPECT_LT(off_deg, 0.7);
  // The peer's is 10.4 px over ten views. One of these six, the first, has a tracked pose that is off by 1.7 mm and 0.8
  // degrees from what its picture says, whichever hand-eye; the others are below.
  EXPECT_LT(result->held_out_median_px, 10.4);
  EXPECT_GT(result->held_out_px, result->tracked_px);
  // The published answer lies within what is stated of ours.
  Vector6d error;
  error << rotation_log(published.rotation() * result->camera_from_sensor.rotation().transpose()), -off_mm;
  EXPECT_LT(error.dot(result->covariance.ldlt().solve(error)), result->region_limit);
  EXPECT_EQ(judge(*result).grade, Grade::marginal) << "six stations of ten";
  RecordProperty("off_mm", std::to_string(off_mm.norm()));
  RecordProperty("off_deg", std::to_string(off_deg));
  RecordProperty("held_out_median_px", std::to_string(result->held_out_median_px));
  RecordProperty("held_out_px", std::to_string(result->held_out_px));
  // Its noise estimated instead, the first station stands out from the others and is named; they agree among
  // themselves, and the published answer, which rests on that station too, stays within the region.
  input.tracker_noise.reset();
  input.camera_covariance = lens->covariance;
  const auto estimated = calibrate_hand_eye(input);
  ASSERT_TRUE(estimated && estimated->solved);
  EXPECT_THAT(estimated->outliers, ::testing::ElementsAre("calib.left.images.0.png"));
  EXPECT_LT(estimated->held_out_px, 10);
  error << rotation_log(published.rotation() * estimated->camera_from_sensor.rotation().transpose()),
      published.translation() - estimated->camera_from_sensor.translation();
  EXPECT_LT(error.dot(estimated->covariance.ldlt().solve(error)), estimated->region_limit);
}

}  // namespace
}  // namespace birdseye::calibration
