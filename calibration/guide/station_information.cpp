#include "calibration/guide/station_information.hpp"

#include <cmath>
#include <utility>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

// Before any station: nothing is known of the directions, and a scope and a table are of the order of half a metre.
constexpr double kPriorAngle_rad = 1, kPriorHandEye_mm = 300, kPriorBoard_mm = 1000;

template <typename To, typename From>
Matrix6d adjoint(const Transform<To, From>& t) {
  Matrix6d m = Matrix6d::Zero();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = t.rotation();
  m.bottomLeftCorner<3, 3>() = cross_matrix(t.translation()) * t.rotation();
  return m;
}

/// The rotation's axis times the sine of its angle: none where the angle is half a turn, for which of the two axes it
/// is noise would say.
Eigen::Vector3d sine_axis(const Eigen::Matrix3d& r) {
  return 0.5 * Eigen::Vector3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
}

bool in_picture(const CameraModel& c, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= c.width_px - 1 && pixel.y() <= c.height_px - 1;
}

}  // namespace

StationInformation::StationInformation(const CameraModel& camera, std::vector<Eigen::Vector3d> board_points_mm,
                                       const Transform<Camera, Sensor>& camera_from_sensor, double working_mm,
                                       const StationNoise& noise)
    : camera_(camera),
      board_points_mm_(std::move(board_points_mm)),
      corner_weight_(1 / (noise.corner_sigma_px * noise.corner_sigma_px)) {
  Eigen::Matrix<double, 6, 1> tracker;
  tracker.head<3>().setConstant(noise.angle_sigma_rad * noise.angle_sigma_rad);
  tracker.tail<3>().setConstant(noise.position_sigma_mm * noise.position_sigma_mm);
  const Matrix6d into_camera = adjoint(camera_from_sensor);
  tracker_covariance_ = into_camera * tracker.asDiagonal() * into_camera.transpose();
  scale_.head<3>().setConstant(working_mm);
  scale_.tail<3>().setOnes();
  Eigen::Matrix<double, 12, 1> prior;
  prior.head<3>().setConstant(kPriorAngle_rad);
  prior.segment<3>(3).setConstant(kPriorHandEye_mm);
  prior.segment<3>(6).setConstant(kPriorAngle_rad);
  prior.tail<3>().setConstant(kPriorBoard_mm);
  information_ = prior.cwiseAbs2().cwiseInverse().asDiagonal();
  solve();
}

Matrix6d StationInformation::covariance_of(const Transform<Camera, Marker>& camera_from_marker) const {
  Matrix6d corners = Matrix6d::Identity() * 1e-9;  // of a board that is not in the picture nothing follows
  for (const Eigen::Vector3d& point : board_points_mm_) {
    const Eigen::Vector3d p = camera_from_marker * point;
    ProjectionJacobians by;
    const auto pixel = project(camera_, p, &by);
    if (!pixel || !in_picture(camera_, *pixel)) continue;
    Eigen::Matrix<double, 2, 6> row;
    row << -by.by_point * cross_matrix(p), by.by_point;
    corners.noalias() += corner_weight_ * row.transpose() * row;
  }
  return tracker_covariance_ + inverse_symmetric(corners);
}

void StationInformation::add(const Transform<Camera, Marker>& camera_from_marker) {
  Eigen::Matrix<double, 6, 12> by_unknowns;
  by_unknowns << Matrix6d::Identity(), adjoint(camera_from_marker);
  information_ += by_unknowns.transpose() * solve_symmetric(covariance_of(camera_from_marker), Matrix6Xd(by_unknowns));
}

void StationInformation::solve() {
  covariance_ = inverse_information(information_);
}

double StationInformation::expected_error_mm() const {
  return std::sqrt(covariance_.diagonal().head<6>().cwiseProduct(scale_.cwiseAbs2()).sum());
}

double StationInformation::expected_error_mm(const Transform<Camera, Marker>& one_more) const {
  // The measurement's update of a covariance, of which only the hand-eye's diagonal is wanted.
  Eigen::Matrix<double, 6, 12> by_unknowns;
  by_unknowns << Matrix6d::Identity(), adjoint(one_more);
  const Eigen::Matrix<double, 6, 12> told = by_unknowns * covariance_;
  const Matrix6d spread = told * by_unknowns.transpose() + covariance_of(one_more);
  const Matrix6d hand_eye = told.leftCols<6>() * scale_.asDiagonal();
  const double less = hand_eye.cwiseProduct(solve_symmetric(spread, Matrix6Xd(hand_eye))).sum();
  const double now = expected_error_mm();
  return std::sqrt(std::max(0.0, now * now - less));
}

Transform<Camera, Sensor> rough_hand_eye(std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                                         std::span<const Transform<Camera, Marker>> camera_from_marker) {
  // C_j C_i^-1 = X (S_j^-1 S_i) X^-1 for every two stations.
  const std::size_t stations = tracker_from_sensor.size();
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  const auto motion = [&](std::size_t i, std::size_t j) {
    return std::pair{camera_from_marker[j] * camera_from_marker[i].inverse(),
                     tracker_from_sensor[j].inverse() * tracker_from_sensor[i]};
  };
  for (std::size_t i = 0; i < stations; ++i) {
    for (std::size_t j = i + 1; j < stations; ++j) {
      const auto [camera, sensor] = motion(i, j);
      turns += sine_axis(camera.rotation()) * sine_axis(sensor.rotation()).transpose();
    }
  }
  const Eigen::Matrix3d rotation = nearest_rotation(turns);
  constexpr double kLittle = 1e-3;  // against 2 - 2 cos(angle) of the turns
  Eigen::Matrix3d normal = kLittle * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < stations; ++i) {
    for (std::size_t j = i + 1; j < stations; ++j) {
      const auto [camera, sensor] = motion(i, j);
      const Eigen::Matrix3d open = camera.rotation() - Eigen::Matrix3d::Identity();
      normal += open.transpose() * open;
      right += open.transpose() * (rotation * sensor.translation() - camera.translation());
    }
  }
  return {rotation, Eigen::Vector3d(solve_symmetric(normal, right))};
}

}  // namespace birdseye::calibration
