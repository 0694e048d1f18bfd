#pragma once

#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/solve/board.hpp"

namespace birdseye::calibration {

struct HandEyeSettings {
  // What one station's pose and one corner are uncertain by (one standard deviation per axis), which weighs them.
  double position_sigma_mm = 0.1;
  double angle_sigma_rad = 3e-4;
  double corner_sigma_px = 0.1;
};

struct HandEye {
  Transform<Camera, Sensor> camera_from_sensor;
  Transform<Tracker, Marker> tracker_from_marker;
  /// Of the corners, projected through the tracker's poses as they were measured: what an overlay there would be off
  /// by.
  double tracked_rms_px = 0;
  std::vector<double> view_tracked_rms_px;
};

/// Where the camera sits on its sensor, from stations at which both saw the world at rest: the sensor's pose and a
/// board in the picture. F. Park and B. Martin's closed form (1994, through OpenCV) starts a least-squares fit over the
/// corners, in which each station's pose may move by as much as the tracker is uncertain.
/// Refuses fewer than three stations, and stations whose rotations are all about one axis (Errc::degenerate).
Result<HandEye> solve_hand_eye(std::span<const Eigen::Vector3d> points_mm, std::span<const BoardView> views,
                               std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                               std::span<const Transform<Camera, Marker>> camera_from_marker, const CameraModel& camera,
                               const HandEyeSettings& settings = {});

}  // namespace birdseye::calibration
