#include "calibration/guide/guidance_words.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

// Less than this nobody does by eye.
constexpr double kLeastTilt_rad = 6 * kRadPerDeg, kLeastTurn_rad = 12 * kRadPerDeg;
constexpr double kLeastShare = 0.1;       // of the distance
constexpr double kLeastOffCentre = 0.08;  // of the picture's size

const Eigen::Matrix3d kTurnedOver = Eigen::Vector3d(1, -1, -1).asDiagonal();

/// A rotation as a tilt of the z axis, by the shortest way, after a turn about it.
struct TiltAndTurn {
  Eigen::Vector3d axis;  ///< where z comes to lie
  double turn_rad;       ///< about z, x to y
};
TiltAndTurn tilt_and_turn(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d axis = rotation.col(2);
  const Eigen::Matrix3d tilt = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
  const Eigen::Matrix3d turn = tilt.transpose() * rotation;
  return {axis, std::atan2(turn(1, 0), turn(0, 0))};
}

double tilt_of(const Eigen::Vector3d& axis) {
  return std::atan2(axis.head<2>().norm(), axis.z());
}

int whole_degrees(double angle_rad) {
  constexpr double kStep_deg = 5;
  return static_cast<int>(kStep_deg * std::round(angle_rad * kDegPerRad / kStep_deg));
}

/// Of a vector in the picture, y down.
std::string direction_word(double x, double y) {
  static const char* const kWords[] = {"to the right", "down and to the right", "down", "down and to the left",
                                       "to the left",  "up and to the left",    "up",   "up and to the right"};
  const auto sector = static_cast<std::size_t>(std::lround(std::atan2(y, x) / (45 * kRadPerDeg)) + 8) % 8;
  return kWords[sector];
}

std::string turn_words(double turn_rad) {
  const double size = std::abs(turn_rad);
  const char* const way = turn_rad > 0 ? "clockwise" : "anticlockwise";
  static const char* const kEighths[] = {"an eighth of a turn", "a quarter of a turn", "three eighths of a turn",
                                         "half a turn"};
  const long eighths = std::lround(size / (45 * kRadPerDeg));
  constexpr double kNear_rad = 8 * kRadPerDeg;
  const bool named = eighths > 0 && std::abs(size - static_cast<double>(eighths) * 45 * kRadPerDeg) < kNear_rad;
  const std::string amount = named ? kEighths[eighths - 1] : fmt::format("{} degrees", whole_degrees(size));
  return fmt::format("turn it {} {} about its long axis", amount, way);
}

std::string off_centre_words(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() / camera.width_px - 0.5, y = pixel.y() / camera.height_px - 0.5;
  const std::string row = y < -kLeastOffCentre ? "upper" : y > kLeastOffCentre ? "lower" : "";
  const std::string column = x < -kLeastOffCentre ? "left" : x > kLeastOffCentre ? "right" : "";
  if (row.empty() && column.empty()) return "bring the board to the middle of the picture";
  const char* const between = row.empty() || column.empty() ? "" : " ";
  return fmt::format("bring the board to the {}{}{} of the picture", row, between,
                     column.empty() ? " part"
                     : row.empty()  ? column + " side"
                                    : column);
}

}  // namespace

ScopeView scope_view(const Transform<Camera, Marker>& camera_from_marker) {
  const Transform<Marker, Camera> marker_from_camera = camera_from_marker.inverse();
  ScopeView view;
  view.from_behind = marker_from_camera.rotation()(2, 2) < 0;
  const Eigen::Matrix3d rotation =
      view.from_behind ? kTurnedOver * marker_from_camera.rotation() : marker_from_camera.rotation();
  const auto [axis, turn_rad] = tilt_and_turn(rotation);
  view.tilt_rad = tilt_of(axis);
  view.direction_rad = std::atan2(axis.y(), axis.x());
  view.turn_rad = turn_rad;
  view.distance_mm = std::abs(marker_from_camera.translation().z()) / std::max(axis.z(), 1e-6);
  return view;
}

Transform<Camera, Marker> pose_of(const ScopeView& view, const Eigen::Vector3d& centre_mm,
                                  const Eigen::Vector2d& centre_tangent) {
  const Eigen::Vector3d tilt_axis(-std::sin(view.direction_rad), std::cos(view.direction_rad), 0);
  const Eigen::Matrix3d upright =
      rotation_exp(view.tilt_rad * tilt_axis) * rotation_exp(view.turn_rad * Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d rotation = (view.from_behind ? kTurnedOver * upright : upright).transpose();
  const Eigen::Vector3d centre_in_camera = view.distance_mm * centre_tangent.homogeneous();
  return {rotation, Eigen::Vector3d(centre_in_camera - rotation * centre_mm)};
}

std::string words_for(const Transform<Camera, Marker>& now, const Transform<Camera, Marker>& next,
                      const CameraModel& camera, const Eigen::Vector3d& centre_mm) {
  // The next camera's axes as the camera has them now.
  const auto [axis, turn_rad] = tilt_and_turn(now.rotation() * next.rotation().transpose());
  std::vector<std::string> parts;
  if (tilt_of(axis) > kLeastTilt_rad) {
    // The tip points along the axis, so that the camera head lies the other way.
    parts.push_back(fmt::format("tilt the scope {} degrees {}, as the picture shows it", whole_degrees(tilt_of(axis)),
                                direction_word(-axis.x(), -axis.y())));
  }
  if (std::abs(turn_rad) > kLeastTurn_rad) parts.push_back(turn_words(turn_rad));
  const double from_mm = (now * centre_mm).z(), to_mm = (next * centre_mm).z();
  if (std::abs(to_mm - from_mm) > kLeastShare * from_mm) {
    parts.push_back(to_mm < from_mm ? fmt::format("go {:.0f} mm nearer", from_mm - to_mm)
                                    : fmt::format("draw back by {:.0f} mm", to_mm - from_mm));
  }
  const auto from_px = project(camera, now * centre_mm), to_px = project(camera, next * centre_mm);
  const Eigen::Vector2d size_px(camera.width_px, camera.height_px);
  if (to_px && (!from_px || (*to_px - *from_px).cwiseQuotient(size_px).norm() > kLeastOffCentre)) {
    parts.push_back(off_centre_words(camera, *to_px));
  }
  if (parts.empty()) return "hold the scope where it is";
  std::string words = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) words += (i + 1 == parts.size() ? ", and " : ", ") + parts[i];
  return words;
}

}  // namespace birdseye::calibration
