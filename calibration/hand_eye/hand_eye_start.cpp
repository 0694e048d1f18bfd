#include "calibration/hand_eye/hand_eye_start.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

/// The closed forms go through all pairs, some with a matrix of twelve rows for each.
constexpr std::size_t kMostStations = 60;
constexpr double kHalfCircle = 170 * kRadPerDeg;
constexpr double kRotationError = 1e-6;

using BodyFromSensor = Transform<TrackedBody, Sensor>;

BodyFromSensor body_from_sensor(const SummedStation& station) {
  return station.chain.tracker_from_body.inverse() * station.chain.tracker_from_sensor;
}

std::vector<SummedStation> thinned(std::span<const SummedStation> stations) {
  const std::size_t count = std::min(stations.size(), kMostStations);
  std::vector<SummedStation> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(stations[i * stations.size() / count]);
  return out;
}

struct OpenCvPoses {
  std::vector<cv::Mat> body_from_sensor_r, body_from_sensor_t, camera_from_marker_r, camera_from_marker_t;
};

HandEyeStart by_opencv(const OpenCvPoses& poses, cv::HandEyeCalibrationMethod method, const char* name,
                       double length_mm) {
  HandEyeStart out;
  out.method = name;
  cv::Mat r, t;
  try {
    cv::calibrateHandEye(poses.body_from_sensor_r, poses.body_from_sensor_t, poses.camera_from_marker_r,
                         poses.camera_from_marker_t, r, t, method);
  } catch (const std::exception&) {
    out.failed = "gave up";
    return out;
  }
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  if (r.size() != cv::Size(3, 3) || t.total() != 3) {
    out.failed = "gave nothing";
    return out;
  }
  cv::cv2eigen(r, rotation);
  cv::cv2eigen(t.reshape(1, 3), translation);
  if (!rotation.allFinite() || !translation.allFinite()) {
    out.failed = "gave no numbers";
  } else if ((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm() > kRotationError ||
             rotation.determinant() < 0) {
    out.failed = "gave no rotation";
  } else {
    out.camera_from_sensor =
        Transform<Sensor, Camera>(nearest_rotation(rotation), Eigen::Vector3d(length_mm * translation)).inverse();
  }
  return out;
}

double length_of(std::span<const SummedStation> stations) {
  double squares = 0;
  for (const SummedStation& s : stations)
    squares += body_from_sensor(s).translation().squaredNorm() + s.camera_from_marker.translation().squaredNorm();
  return std::sqrt(std::max(1e-300, squares / static_cast<double>(2 * stations.size())));
}

}  // namespace

Eigen::Matrix3d rotation_by_axes(std::span<const SummedStation> all) {
  const std::vector<SummedStation> stations = thinned(all);
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < stations.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Eigen::Vector3d of_sensor =
          rotation_log(body_from_sensor(stations[i]).rotation().transpose() * body_from_sensor(stations[k]).rotation());
      const Eigen::Vector3d of_camera = rotation_log(stations[i].camera_from_marker.rotation() *
                                                     stations[k].camera_from_marker.rotation().transpose());
      if (std::max(of_sensor.norm(), of_camera.norm()) < kHalfCircle) correlation += of_camera * of_sensor.transpose();
    }
  }
  return nearest_rotation(correlation);
}

Transform<TrackedBody, Marker> body_from_marker_of(std::span<const SummedStation> stations,
                                                   const Transform<Camera, Sensor>& camera_from_sensor) {
  Eigen::Matrix3d rotations = Eigen::Matrix3d::Zero();
  std::array<std::vector<double>, 3> translations;
  for (const SummedStation& s : stations) {
    const auto one = body_from_sensor(s) * camera_from_sensor.inverse() * s.camera_from_marker;
    rotations += one.rotation();
    for (int i = 0; i < 3; ++i) translations.at(static_cast<std::size_t>(i)).push_back(one.translation()[i]);
  }
  Eigen::Vector3d middle;
  for (int i = 0; i < 3; ++i) {
    auto& values = translations.at(static_cast<std::size_t>(i));
    std::sort(values.begin(), values.end());
    middle[i] = 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  }
  return {nearest_rotation(rotations), middle};
}

ChainState translations_after(std::span<const SummedStation> stations, const Eigen::Matrix3d& camera_from_sensor,
                              bool scale_free) {
  ChainState out;
  const auto body_from_marker =
      body_from_marker_of(stations, Transform<Camera, Sensor>(camera_from_sensor, Eigen::Vector3d::Zero())).rotation();
  // body_from_sensor's translation = R_body_from_camera (t_hand_eye - scale * t_view) + t_body_from_marker.
  const auto rows = static_cast<Eigen::Index>(3 * stations.size());
  Eigen::MatrixXd a(rows, 7);
  Eigen::VectorXd b(rows);
  const double length = length_of(stations);
  Eigen::Index row = 0;
  for (const SummedStation& s : stations) {
    const Eigen::Matrix3d body_from_camera = body_from_marker * s.camera_from_marker.rotation().transpose();
    a.block<3, 3>(row, 0) = body_from_camera;
    a.block<3, 3>(row, 3).setIdentity();
    a.block<3, 1>(row, 6) = -body_from_camera * s.camera_from_marker.translation() / length;
    b.segment<3>(row) = body_from_sensor(s).translation() / length;
    row += 3;
  }
  Eigen::VectorXd x = Eigen::VectorXd::Ones(7);
  if (scale_free) {
    x = a.colPivHouseholderQr().solve(b);
  } else {
    x.head<6>() = a.leftCols<6>().colPivHouseholderQr().solve(b - a.col(6));
  }
  out.camera_from_sensor = {camera_from_sensor, Eigen::Vector3d(length * x.head<3>())};
  out.body_from_marker = {body_from_marker, Eigen::Vector3d(length * x.segment<3>(3))};
  out.board_scale = x[6];
  return out;
}

std::vector<HandEyeStart> closed_forms(std::span<const SummedStation> all) {
  const std::vector<SummedStation> stations = thinned(all);
  const double length_mm = length_of(stations);
  OpenCvPoses poses;
  for (const SummedStation& s : stations) {
    const BodyFromSensor body = body_from_sensor(s);
    cv::eigen2cv(body.rotation(), poses.body_from_sensor_r.emplace_back());
    cv::eigen2cv(Eigen::Vector3d(body.translation() / length_mm), poses.body_from_sensor_t.emplace_back());
    cv::eigen2cv(s.camera_from_marker.rotation(), poses.camera_from_marker_r.emplace_back());
    cv::eigen2cv(Eigen::Vector3d(s.camera_from_marker.translation() / length_mm),
                 poses.camera_from_marker_t.emplace_back());
  }
  std::vector<HandEyeStart> out{by_opencv(poses, cv::CALIB_HAND_EYE_TSAI, "Tsai", length_mm),
                                by_opencv(poses, cv::CALIB_HAND_EYE_PARK, "Park", length_mm),
                                by_opencv(poses, cv::CALIB_HAND_EYE_HORAUD, "Horaud", length_mm),
                                by_opencv(poses, cv::CALIB_HAND_EYE_ANDREFF, "Andreff", length_mm),
                                by_opencv(poses, cv::CALIB_HAND_EYE_DANIILIDIS, "Daniilidis", length_mm)};
  HandEyeStart axes;
  axes.method = "axes";
  axes.camera_from_sensor = translations_after(stations, rotation_by_axes(stations), false).camera_from_sensor;
  if (!axes.camera_from_sensor.matrix().allFinite()) axes.failed = "gave no numbers";
  out.push_back(axes);
  return out;
}

}  // namespace birdseye::calibration
