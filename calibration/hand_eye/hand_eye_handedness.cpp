#include "calibration/hand_eye/hand_eye_handedness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/quaternion_order.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_start.hpp"

namespace birdseye::calibration {

namespace {

// A fit so bad that another reading of the poses may be the right one, and how many times better that has to fit.
constexpr double kBadFit_deg = 3, kBadFit_mm = 5;
constexpr double kFarBetter = 3;

using Stations = std::vector<SummedStation>;

/// How far the rotations are from any hand-eye: median over stations.
double rotation_misfit_deg(std::span<const SummedStation> stations) {
  const Transform<Camera, Sensor> hand_eye(rotation_by_axes(stations), Eigen::Vector3d::Zero());
  const Eigen::Matrix3d body_from_marker = body_from_marker_of(stations, hand_eye).rotation();
  std::vector<double> out;
  for (const SummedStation& s : stations) {
    const Eigen::Matrix3d predicted =
        body_from_marker * s.camera_from_marker.rotation().transpose() * hand_eye.rotation();
    const Eigen::Matrix3d body_from_sensor =
        s.chain.tracker_from_body.rotation().transpose() * s.chain.tracker_from_sensor.rotation();
    out.push_back(rotation_angle_between(predicted, body_from_sensor) * kDegPerRad);
  }
  return median_of(std::move(out));
}

/// How far the positions are from any hand-eye and any size of the board, where the rotations are right: median over
/// stations.
double position_misfit_mm(std::span<const SummedStation> stations) {
  const Eigen::Matrix3d rotation = rotation_by_axes(stations);
  ChainState state = translations_after(stations, rotation, true);
  if (!(state.board_scale > 0)) state = translations_after(stations, rotation, false);  // no board is of such a size
  std::vector<double> out;
  for (const SummedStation& s : stations)
    out.push_back(chain_residual(s.chain, s.camera_from_marker, state).value.tail<3>().norm());
  return median_of(std::move(out));
}

template <typename Pose>
Pose inverted(const Pose& pose) {
  return {pose.rotation().transpose(), Eigen::Vector3d::Zero()};
}

/// How the quaternions of a file may have to be read, and whether the file holds the inverse of what is held here.
struct QuaternionReading {
  QuaternionOrder order = QuaternionOrder::as_read;
  bool inverse = false;
  template <typename Pose>
  [[nodiscard]] Pose of(Pose pose) const {
    if (order == QuaternionOrder::as_read) return pose;
    if (inverse) pose = turned_round(pose);
    pose = Pose(reordered(pose.rotation(), order), pose.translation());
    return inverse ? turned_round(pose) : pose;
  }
};
constexpr std::array kQuaternionReadings{QuaternionReading{}, QuaternionReading{QuaternionOrder::w_first, false},
                                         QuaternionReading{QuaternionOrder::w_last, false},
                                         QuaternionReading{QuaternionOrder::w_first, true},
                                         QuaternionReading{QuaternionOrder::w_last, true}};

template <typename Change>
Stations with_poses(const StationsInOrder& in, const Change& change) {
  Stations out(in.stations.begin(), in.stations.end());
  for (SummedStation& s : out) {
    s.chain.tracker_from_sensor = change(s.chain.tracker_from_sensor);
    s.chain.tracker_from_body = change(s.chain.tracker_from_body);
  }
  return out;
}

Stations with_eyes_turned_round(const StationsInOrder& in) {
  Stations out(in.stations.begin(), in.stations.end());
  for (SummedStation& s : out) s.camera_from_marker = turned_round(s.camera_from_marker);
  return out;
}

/// The poses of the tracker, of the camera, or of both, by other readings of their quaternions.
Stations with_readings(const StationsInOrder& in, const QuaternionReading& tracked, const QuaternionReading& eye) {
  Stations out = with_poses(in, [&tracked](const auto& pose) { return tracked.of(pose); });
  for (SummedStation& s : out) s.camera_from_marker = eye.of(s.camera_from_marker);
  return out;
}

Finding seem_disordered(QuaternionOrder tracked, QuaternionOrder eye, double fit_deg, double fit_mm) {
  const bool of_tracker = tracked != QuaternionOrder::as_read, of_eye = eye != QuaternionOrder::as_read;
  const bool first = (of_tracker ? tracked : eye) == QuaternionOrder::w_first;
  const char* const whose = !of_eye ? "the tracker's poses" : of_tracker ? "both files of poses" : "the camera's poses";
  return {Grade::fail,
          fmt::format("the quaternions of {} seem to have w {}: read so, the poses fit to {:.1f} degrees and {:.1f} "
                      "mm, and not as they were read",
                      whose, first ? "first" : "last", fit_deg, fit_mm),
          fmt::format("name the columns in a header as they stand: t,x,y,z,{}",
                      first ? "qw,qx,qy,qz" : "qx,qy,qz,qw (q0,q1,q2,q3 are read as w,x,y,z)")};
}

/// A quaternion with w in the wrong place turns as the inverse does, in frames of its own, and two such files as right
/// ones: only the positions, which stay where they are, tell. least_mm: to which other readings fit them.
std::optional<Finding> find_disorder(const StationsInOrder& in, double least_mm) {
  double best_mm = least_mm / kFarBetter, best_deg = 0;
  QuaternionOrder tracked = QuaternionOrder::as_read, eye = QuaternionOrder::as_read;
  for (const QuaternionReading& of_tracker : kQuaternionReadings) {
    for (const QuaternionReading& of_eye : kQuaternionReadings) {
      if (!in.given_poses && of_eye.order != QuaternionOrder::as_read) continue;
      const Stations stations = with_readings(in, of_tracker, of_eye);
      const double misfit_deg = rotation_misfit_deg(stations);
      if (misfit_deg > kBadFit_deg) continue;
      const double misfit_mm = position_misfit_mm(stations);
      if (misfit_mm >= best_mm) continue;
      best_mm = misfit_mm;
      best_deg = misfit_deg;
      tracked = of_tracker.order;
      eye = of_eye.order;
    }
  }
  if (tracked == QuaternionOrder::as_read && eye == QuaternionOrder::as_read) return std::nullopt;
  return seem_disordered(tracked, eye, best_deg, best_mm);
}

/// Which option to give, or to leave out.
std::string direction_advice(const StationsInOrder& in) {
  const char* const tracker = in.sensor_inverted ? "leave --poses-are out" : "say --poses-are sensor_from_tracker";
  if (!in.given_poses) {
    return in.sensor_inverted ? "if the poses are tracker_from_sensor, leave --poses-are out"
                              : "if the poses are sensor_from_tracker, say so: --poses-are sensor_from_tracker";
  }
  const char* const eye =
      in.eye_inverted ? "if they are where the camera is in the board's frame, leave --eye-poses-are out"
                      : "if they are where the board is in the camera's frame, as OpenCV and ArUco find it, say "
                        "--eye-poses-are camera_from_marker";
  return fmt::format(
      "the poses are to be tracker_from_sensor and marker_from_camera, and one of the two is the other way: of the "
      "camera's, {}; of the tracker's, {}",
      eye, tracker);
}

Finding seem_inverted(double as_given_deg, double inverted_deg, const StationsInOrder& in) {
  return {
      Grade::fail,
      fmt::format("the poses seem to be inverted: they fit to {:.1f} degrees as given, to {:.1f} the other way "
                  "round",
                  as_given_deg, inverted_deg),
      direction_advice(in) + "; if w is the first of a quaternion's four numbers, name them in a header: qw,qx,qy,qz"};
}

/// Which of a position's axes stand for x, y and z, and with which signs.
struct AxesReading {
  std::array<int, 3> axes{0, 1, 2};
  std::array<int, 3> signs{1, 1, 1};
  [[nodiscard]] Eigen::Vector3d of(const Eigen::Vector3d& v) const {
    return {signs[0] * v[axes[0]], signs[1] * v[axes[1]], signs[2] * v[axes[2]]};
  }
  [[nodiscard]] bool exchanged() const { return axes != std::array{0, 1, 2}; }
  [[nodiscard]] bool mirrored() const { return !exchanged() && signs == std::array{-1, -1, -1}; }
  /// "-x, z, y"; of axes in their places those alone that have the wrong sign.
  [[nodiscard]] std::string words() const {
    std::string out;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!exchanged() && signs.at(i) > 0) continue;
      fmt::format_to(std::back_inserter(out), "{}{}{}", out.empty() ? "" : ", ",
                     exchanged() && signs.at(i) < 0 ? "-" : "", "xyz"[axes.at(i)]);
    }
    return out;
  }
};

/// Of positions whose axes have the wrong signs, or are exchanged, while the rotations are right. A mirror turns
/// rotations as a half turn about its normal does, which is a frame as good as another: of a left-handed frame what
/// shows is that all three signs are wrong.
std::optional<Finding> find_wrong_axes(const StationsInOrder& in) {
  const double as_given_mm = position_misfit_mm(in.stations);
  if (as_given_mm < kBadFit_mm) return std::nullopt;
  double best_mm = as_given_mm / kFarBetter;
  std::optional<AxesReading> best;
  AxesReading reading;
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      for (std::size_t i = 0; i < 3; ++i) reading.signs.at(i) = (signs >> i & 1U) != 0 ? -1 : 1;
      const double misfit_mm = position_misfit_mm(with_poses(in, [&reading](auto pose) {
        using Pose = decltype(pose);
        return Pose(pose.rotation(), reading.of(pose.translation()));
      }));
      if (misfit_mm >= best_mm) continue;
      best_mm = misfit_mm;
      best = reading;
    }
  } while (std::ranges::next_permutation(reading.axes).found);
  if (auto found = find_disorder(in, best ? best_mm : as_given_mm)) return found;
  if (!best) return std::nullopt;
  if (best->mirrored()) {
    return Finding{
        Grade::fail,
        fmt::format("the poses seem to be mirrored: they fit to {:.1f} mm as given, to {:.1f} as a left-handed frame "
                    "has them",
                    as_given_mm, best_mm),
        "have the program that writes them write a right-handed frame; or turn the sign of z in positions, and of qx "
        "and qy in quaternions (of the third row and the third column in matrices)"};
  }
  if (best->exchanged()) {
    return Finding{Grade::fail,
                   fmt::format("the axes of the tracker's positions seem to be exchanged: they fit to {:.1f} mm as "
                               "given, to {:.1f} where x, y, z are read from {}",
                               as_given_mm, best_mm, best->words()),
                   "name the columns in a header as they stand, or have the program that writes the poses turn "
                   "positions and rotations alike"};
  }
  return Finding{Grade::fail,
                 fmt::format("the tracker's positions seem to have the wrong sign of {}: they fit to {:.1f} mm as "
                             "given, to {:.1f} with the other sign",
                             best->words(), as_given_mm, best_mm),
                 "have the program that writes the poses turn positions and rotations alike"};
}

}  // namespace

std::optional<Finding> find_wrong_frames(const StationsInOrder& in) {
  const double as_given_deg = rotation_misfit_deg(in.stations);
  if (as_given_deg < kBadFit_deg) return find_wrong_axes(in);
  const double inverted_deg = rotation_misfit_deg(with_poses(in, [](const auto& pose) { return inverted(pose); }));
  if (inverted_deg > as_given_deg / kFarBetter) return std::nullopt;
  double inverted_mm = position_misfit_mm(with_poses(in, [](const auto& pose) { return turned_round(pose); }));
  if (in.given_poses) inverted_mm = std::min(inverted_mm, position_misfit_mm(with_eyes_turned_round(in)));
  if (auto found = find_disorder(in, inverted_mm)) return found;
  return seem_inverted(as_given_deg, inverted_deg, in);
}

}  // namespace birdseye::calibration
