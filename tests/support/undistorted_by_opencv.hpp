#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::testing {

/// A picture, the lens that took it, and what OpenCV made of both; the pictures are empty where they cannot be read.
struct UndistortedByOpenCv {
  CameraModel lens;
  cv::Mat picture, straight;
};

/// side: "left" or "right", of the pair in the recordings' folder camera_undistort_opencv. flags: as cv::imread has
/// them.
inline UndistortedByOpenCv undistorted_by_opencv(const std::filesystem::path& recordings, const std::string& side,
                                                 int flags) {
  const std::filesystem::path folder = recordings / "camera_undistort_opencv";
  UndistortedByOpenCv out;
  out.picture = cv::imread(folder / (side + "01.jpg"), flags);
  out.straight = cv::imread(folder / (side + "_cv_undistorted_4.1.1.26.png"), flags);
  cv::Mat k, d;
  cv::FileStorage(folder / ("calib." + side + ".intrinsic.xml"), cv::FileStorage::READ).getFirstTopLevelNode() >> k;
  cv::FileStorage(folder / ("calib." + side + ".distortion.xml"), cv::FileStorage::READ).getFirstTopLevelNode() >> d;
  CameraModel& c = out.lens;
  c.width_px = out.picture.cols;
  c.height_px = out.picture.rows;
  c.fx_px = k.at<double>(0, 0);
  c.fy_px = k.at<double>(1, 1);
  c.cx_px = k.at<double>(0, 2);
  c.cy_px = k.at<double>(1, 2);
  c.k1 = d.at<double>(0);
  c.k2 = d.at<double>(1);
  c.p1 = d.at<double>(2);
  c.p2 = d.at<double>(3);
  return out;
}

}  // namespace birdseye::testing
