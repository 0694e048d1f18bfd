#include "calibration/hand_eye/hand_eye_handedness.hpp"

#include <fmt/format.h>

#include <span>
#include <string>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
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

template <typename Change>
Stations with_poses(const StationsInOrder& in, const Change& change) {
  Stations out(in.stations.begin(), in.stations.end());
  for (SummedStation& s : out) {
    s.chain.tracker_from_sensor = change(s.chain.tracker_from_sensor);
    s.chain.tracker_from_body = change(s.chain.tracker_from_body);
  }
  return out;
}

Finding seem_inverted(double as_given_deg, double inverted_deg, bool given_poses) {
  return {Grade::fail,
          fmt::format("the poses seem to be inverted: they fit to {:.1f} degrees as given, to {:.1f} the other way "
                      "round",
                      as_given_deg, inverted_deg),
          given_poses
              ? "the poses are to be tracker_from_sensor and marker_from_camera, and one of the two is the other way: "
                "of the camera's, if they are where the board is in the camera's frame, as OpenCV and ArUco find it, "
                "say --eye-poses-are camera_from_marker; of the tracker's, say --poses-are sensor_from_tracker; or w "
                "is the first of a quaternion's four numbers: name them in a header, qw,qx,qy,qz"
              : "if the poses are sensor_from_tracker, say so: --poses-are sensor_from_tracker; if w is the first of "
                "the quaternion's four numbers, name them in a header: qw,qx,qy,qz"};
}

/// Of positions whose axes have the wrong signs while the rotations are right. A mirror turns rotations as a half turn
/// about its normal does, which is a frame as good as another: of a left-handed frame what shows is that all three
/// signs are wrong.
std::optional<Finding> find_wrong_signs(const StationsInOrder& in) {
  constexpr int kAll = 7;
  const double as_given_mm = position_misfit_mm(in.stations);
  if (as_given_mm < kBadFit_mm) return std::nullopt;
  double best_mm = as_given_mm / kFarBetter;
  int best = 0;
  for (int axes = 1; axes <= kAll; ++axes) {
    const Eigen::Vector3d signs((axes & 1) != 0 ? -1 : 1, (axes & 2) != 0 ? -1 : 1, (axes & 4) != 0 ? -1 : 1);
    const double misfit_mm = position_misfit_mm(with_poses(in, [&signs](auto pose) {
      using Pose = decltype(pose);
      return Pose(pose.rotation(), Eigen::Vector3d(signs.cwiseProduct(pose.translation())));
    }));
    if (misfit_mm >= best_mm) continue;
    best_mm = misfit_mm;
    best = axes;
  }
  if (best == 0) return std::nullopt;
  if (best == kAll) {
    return Finding{
        Grade::fail,
        fmt::format("the poses seem to be mirrored: they fit to {:.1f} mm as given, to {:.1f} as a left-handed frame "
                    "has them",
                    as_given_mm, best_mm),
        "have the program that writes them write a right-handed frame; or turn the sign of z in positions, and of qx "
        "and qy in quaternions (of the third row and the third column in matrices)"};
  }
  std::string names;
  for (int axis = 0; axis < 3; ++axis) {
    if ((best & (1 << axis)) != 0) names += fmt::format("{}{}", names.empty() ? "" : ", ", "xyz"[axis]);
  }
  return Finding{Grade::fail,
                 fmt::format("the tracker's positions seem to have the wrong sign of {}: they fit to {:.1f} mm as "
                             "given, to {:.1f} with the other sign",
                             names, as_given_mm, best_mm),
                 "have the program that writes the poses turn positions and rotations alike"};
}

}  // namespace

std::optional<Finding> find_wrong_frames(const StationsInOrder& in) {
  const double as_given_deg = rotation_misfit_deg(in.stations);
  if (as_given_deg < kBadFit_deg) return find_wrong_signs(in);
  const double inverted_deg = rotation_misfit_deg(with_poses(in, [](const auto& pose) { return inverted(pose); }));
  if (inverted_deg > as_given_deg / kFarBetter) return std::nullopt;
  return seem_inverted(as_given_deg, inverted_deg, in.given_poses);
}

}  // namespace birdseye::calibration
