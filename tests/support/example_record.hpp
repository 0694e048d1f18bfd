#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "calibration/record/calibration_record.hpp"

namespace birdseye::testing {

/// A record with every entry, made with this camera's frames and these instruments.
inline calibration::CalibrationRecord example_record(int width_px, int height_px, calibration::Identity tracker,
                                                     calibration::Identity camera) {
  using namespace calibration;
  CalibrationRecord record;
  record.scope = "30 degrees, 10 mm, no. 17";
  record.tracker = std::move(tracker);
  record.camera = std::move(camera);
  const Provenance provenance{"2026-11-22T09:30:00Z", "birdseye 0.1.0", "chessboard:14x10:3mm, 24 views",
                              Grade::marginal};
  LensEntry lens;
  lens.provenance = provenance;
  lens.camera = {width_px, height_px, 608.671795, 606.1 / 3, 323.1, 231.3, -0.43, 0.24, 1e-4, -2e-5, 0.1};
  // In the picture, however small it is.
  lens.camera.cx_px = std::min(lens.camera.cx_px, static_cast<double>(width_px));
  lens.camera.cy_px = std::min(lens.camera.cy_px, static_cast<double>(height_px));
  lens.model = "radial3_tangential2";
  const Eigen::Matrix<double, 9, 1> sigma = Eigen::Matrix<double, 9, 1>::LinSpaced(0.1, 0.9);
  lens.covariance = sigma * sigma.transpose() / 3;
  lens.rms_px = 0.21;
  lens.held_out_px = 0.25;
  lens.rod_angle_deg = 30;
  record.lens = lens;
  HandEyeEntry hand_eye;
  hand_eye.provenance = provenance;
  hand_eye.camera_from_sensor = Transform<Camera, Sensor>(
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(), {1.0 / 3, -120, 250});
  hand_eye.covariance = Eigen::Matrix<double, 6, 6>::Identity() / 7;
  hand_eye.rms_px = 1.5;
  hand_eye.held_out_px = 1.75;
  hand_eye.held_out_mm = 0.5;
  hand_eye.independent_stations = 14;
  hand_eye.rod = RodEntry{30, Eigen::Vector3d(1, -2, 20).normalized(), {12, -3, 1.0 / 3}, 1};
  record.hand_eye = hand_eye;
  record.tip = TipEntry{provenance, {1, 2, 1.0 / 3}, Eigen::Matrix3d::Identity() / 9, 0.3};
  record.latency = LatencyEntry{provenance, 83.1, 82.6, 83.6, 12};
  return record;
}

/// Of a straight scope, whose figures alone say how well it is calibrated.
inline calibration::CalibrationRecord straight_scope_record(int width_px = 768, int height_px = 576,
                                                            calibration::Identity tracker = {},
                                                            calibration::Identity camera = {}) {
  calibration::CalibrationRecord record = example_record(width_px, height_px, std::move(tracker), std::move(camera));
  record.lens->rod_angle_deg.reset();
  record.lens->covariance.setZero();
  record.hand_eye->rod.reset();
  record.hand_eye->covariance.setZero();
  record.hand_eye->independent_stations.reset();
  return record;
}

}  // namespace birdseye::testing
