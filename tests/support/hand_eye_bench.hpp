#pragma once

#include <array>
#include <random>
#include <string>

#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::testing {

/// A laparoscope of 300 mm, its sensor at the handle, over a board of 11 x 8 corners 6 mm apart, 100 mm away: what to
/// simulate of it. Noise is per axis.
struct HandEyeScene {
  int stations = 30;
  double corner_px = 0, position_mm = 0, angle_deg = 0;
  bool moving_board = false;
  bool stereo = false;
  bool poses_only = false;
  double time_offset_s = 0;  ///< with motions of some 100 mm/s and 1 rad/s
  double tilt_rad = 0.6;     ///< across the line of sight, uniformly up to this about both axes
  double roll_rad = 1.2;
  bool one_axis = false;  ///< roll only
  double length = 1;      ///< all lengths times this
  unsigned seed = 1;
};

struct HandEyeBench {
  calibration::HandEyeInput input;
  Transform<Camera, Sensor> camera_from_sensor;

  explicit HandEyeBench(const HandEyeScene& scene) : rng_(scene.seed) {
    const double mm = scene.length;
    camera_from_sensor = {rotation_exp(Eigen::Vector3d(0.2, -1.5, 0.1)),
                          Eigen::Vector3d(mm * Eigen::Vector3d(6, -14, -300))};
    const Transform<Tracker, Marker> tracker_from_marker(rotation_exp(Eigen::Vector3d(0.1, 0.1, 0.6)),
                                                         Eigen::Vector3d(mm * Eigen::Vector3d(330, -150, 140)));
    const Transform<TrackedBody, Marker> body_from_marker(rotation_exp(Eigen::Vector3d(-0.7, 0.4, 2)),
                                                          Eigen::Vector3d(mm * Eigen::Vector3d(40, 60, -25)));
    const CameraModel lens = wide_lens();
    if (!scene.poses_only) input.camera = lens;
    if (scene.stereo) {
      input.right = calibration::StereoLens{lens, {}};
      input.right->camera.fx_px *= 1.01;
      input.right->right_from_camera = {rotation_exp(Eigen::Vector3d(0.01, -0.03, 0.002)),
                                        Eigen::Vector3d(mm * Eigen::Vector3d(-4.2, 0.1, 0.05))};
    }
    input.estimate_time_offset = scene.time_offset_s != 0;
    while (static_cast<int>(input.stations.size()) < scene.stations) {
      calibration::HandEyeStation s;
      s.name = "station " + std::to_string(input.stations.size());
      const Transform<Camera, Marker> view = view_of_board(scene);
      if (!shown(lens, view, mm)) continue;
      const Transform<Tracker, Marker> board =
          scene.moving_board ? tracker_from_marker * Transform<Marker, Marker>(rotation_exp(0.4 * uniform3()),
                                                                               Eigen::Vector3d(40 * mm * uniform3()))
                             : tracker_from_marker;
      if (scene.time_offset_s != 0) {
        s.sensor_motion = {Eigen::Vector3d(100 * mm * normal3()), normal3()};
        if (scene.moving_board) s.body_motion = {Eigen::Vector3d(50 * mm * normal3()), 0.5 * normal3()};
      }
      s.tracker_from_sensor = noisy(before(board * view.inverse() * camera_from_sensor, s.sensor_motion, scene), scene);
      if (scene.moving_board) {
        s.tracker_from_body = noisy(before(board * body_from_marker.inverse(), s.body_motion, scene), scene);
      }
      if (scene.poses_only) {
        s.camera_from_marker = view;
      } else {
        s.view = corners(lens, view, scene);
        if (scene.stereo)
          s.right_view = corners(input.right->camera,
                                 Transform<Camera, RightCamera>{} * (input.right->right_from_camera * view), scene);
      }
      input.stations.push_back(std::move(s));
    }
  }

  Eigen::Vector3d normal3() { return {normal_(rng_), normal_(rng_), normal_(rng_)}; }
  Eigen::Vector3d uniform3() { return {uniform_(rng_), uniform_(rng_), uniform_(rng_)}; }

 private:
  static constexpr int kColumns = 11, kRows = 8;
  static constexpr double kSquareMm = 6;

  Transform<Camera, Marker> view_of_board(const HandEyeScene& scene) {
    const Eigen::Vector3d u = uniform3();
    const double tilt = scene.one_axis ? 0 : scene.tilt_rad;
    const Eigen::Matrix3d r = rotation_exp(Eigen::Vector3d(tilt * u.x(), tilt * u.y(), 0)) *
                              rotation_exp(Eigen::Vector3d(0, 0, scene.roll_rad * u.z()));
    const Eigen::Vector3d centre(kSquareMm * (kColumns - 1) / 2, kSquareMm * (kRows - 1) / 2, 0);
    const Eigen::Vector3d at = Eigen::Vector3d(0, 0, 100) + Eigen::Vector3d(6, 6, 15).cwiseProduct(uniform3());
    return {r, Eigen::Vector3d(scene.length * (at - r * centre))};
  }
  static Eigen::Vector3d point(int i, double mm) {
    return {mm * kSquareMm * (i % kColumns), mm * kSquareMm * (i / kColumns), 0};
  }
  static bool shown(const CameraModel& lens, const Transform<Camera, Marker>& view, double mm) {
    for (int i = 0; i < kColumns * kRows; ++i) {
      const auto p = project(lens, view * point(i, mm));
      if (!p || p->x() < 0 || p->y() < 0 || p->x() > lens.width_px || p->y() > lens.height_px) return false;
    }
    return true;
  }
  template <typename Lens>
  calibration::PatternView corners(const CameraModel& lens, const Transform<Lens, Marker>& view,
                                   const HandEyeScene& scene) {
    calibration::PatternView out;
    for (int i = 0; i < kColumns * kRows; ++i) {
      out.ids.push_back(i);
      out.points_in_marker_mm.push_back(point(i, scene.length));
      out.points_px.emplace_back(*project(lens, view * point(i, scene.length)) +
                                 scene.corner_px * Eigen::Vector2d(normal_(rng_), normal_(rng_)));
    }
    return out;
  }
  template <typename From>
  Transform<Tracker, From> before(const Transform<Tracker, From>& pose, const calibration::Motion& motion,
                                  const HandEyeScene& scene) {
    Vector6d step;
    step << -scene.time_offset_s * motion.angular_velocity_rad_s, -scene.time_offset_s * motion.velocity_mm_s;
    return calibration::moved(pose, step);
  }
  template <typename From>
  Transform<Tracker, From> noisy(const Transform<Tracker, From>& pose, const HandEyeScene& scene) {
    Vector6d step;
    step << scene.angle_deg * kRadPerDeg * normal3(), scene.length * scene.position_mm * normal3();
    return calibration::moved(pose, step);
  }

  std::mt19937 rng_;
  std::normal_distribution<double> normal_{0, 1};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

}  // namespace birdseye::testing
