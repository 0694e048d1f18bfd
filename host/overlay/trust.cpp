#include "host/overlay/trust.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/points/point_error.hpp"

namespace birdseye::host {

namespace {

// One sigma of how much later a camera and its grabber hand a picture on than they say, where nobody has measured it:
// half a frame of 25 Hz.
constexpr Duration kUnknownLatency = Duration::from_ms(20);

/// Hand-eye's error is estimated, of two axes at each station: with a probability of 95 % it is no more than so many
/// times that.
double of_few_stations(const ScopeFigures& scope) {
  constexpr double kOfTwenty = 1.23;  // as many as usual, where nobody says how many they were
  if (!scope.hand_eye_stations) return kOfTwenty;
  // Each frame asks, and it takes longer than all else of its budget.
  static const std::vector<double> of_usual = [] {
    std::vector<double> of(65);
    for (std::size_t n = 1; n < of.size(); ++n)
      of[n] = calibration::upper95_over_estimate(2.0 * static_cast<double>(n));
    return of;
  }();
  const int stations = *scope.hand_eye_stations;
  const bool usual = stations > 0 && stations < static_cast<int>(of_usual.size());
  return usual ? of_usual[static_cast<std::size_t>(stations)] : calibration::upper95_over_estimate(2.0 * stations);
}

/// Of a covariance of hand-eye, the error of a point straight ahead across the line of sight, each axis.
double across_mm(const Eigen::Matrix<double, 6, 6>& covariance, double distance_mm) {
  Eigen::Matrix<double, 2, 6> by = Eigen::Matrix<double, 2, 6>::Zero();  // turned by w, (0, 0, d) goes by w x (0, 0, d)
  by(0, 1) = distance_mm;
  by(1, 0) = -distance_mm;
  by(0, 3) = by(1, 4) = 1;
  return std::sqrt(std::max(0.0, (by * covariance * by.transpose()).trace() / 2));
}

/// Hand-eye's error was measured at the board; it is another where the target lies. How far away the board was, its two
/// figures tell: the same error in the picture and in space.
double hand_eye_error_mm(const CameraModel& camera, const Eigen::Vector3d& target_in_camera_mm,
                         const ScopeFigures& scope) {
  // It is given across the line of sight, of two axes.
  const double at_board_mm = std::sqrt(1.5) * *scope.held_out_mm;
  if (!scope.held_out_px || !(*scope.held_out_px > 0)) return at_board_mm;
  const double board_mm = *scope.held_out_mm * camera.fx_px / *scope.held_out_px;
  const double target_mm = target_in_camera_mm.norm();
  if (!(board_mm > 0)) return at_board_mm;
  if (scope.hand_eye_covariance) {
    const double there = across_mm(*scope.hand_eye_covariance, board_mm);
    if (there > 0) return at_board_mm * across_mm(*scope.hand_eye_covariance, target_mm) / there;
  }
  return at_board_mm * std::max(1.0, target_mm / board_mm);
}

/// The stations' poses scatter too, and the error held out counts that: all of it that is not hand-eye's own by its
/// covariance. Without one nobody knows how much.
double pose_in_hand_eye_mm(double hand_eye_mm, const Eigen::Vector3d& target_in_camera_mm, const ScopeFigures& scope) {
  if (!scope.hand_eye_covariance) return 0;
  const double own_mm = std::sqrt(3.0) * across_mm(*scope.hand_eye_covariance, target_in_camera_mm.norm());
  return std::sqrt(std::max(0.0, hand_eye_mm * hand_eye_mm - own_mm * own_mm));
}

/// By how much the place of a direction in the picture is uncertain, as a length at the target.
double lens_error_mm(const CameraModel& camera, const Eigen::Vector3d& target_in_camera_mm, const ScopeFigures& scope) {
  if (!scope.camera_covariance || !(target_in_camera_mm.z() > 0)) return 0;
  const auto at_px = project(camera, target_in_camera_mm);
  if (!at_px) return 0;
  const CameraVector parameters = parameters_of(camera);
  Eigen::Matrix<double, 2, CameraModel::kParameters> by;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const double step = std::max(1e-6, 1e-6 * std::abs(parameters[i]));
    CameraVector other = parameters;
    other[i] += step;
    CameraModel moved = camera;
    set_parameters(moved, other.data());
    const auto moved_px = project(moved, target_in_camera_mm);
    by.col(i) = moved_px ? Eigen::Vector2d((*moved_px - *at_px) / step) : Eigen::Vector2d::Zero();
  }
  const double axis_px = std::sqrt(std::max(0.0, (by * *scope.camera_covariance * by.transpose()).trace() / 2));
  return std::sqrt(3.0) * axis_px * target_in_camera_mm.z() / camera.fx_px;
}

}  // namespace

TrustFigures vouched_for(const TrustFigures& stated) {
  TrustFigures out = stated;
  for (std::optional<double>* const figure :
       {&out.scope.camera_rms_px, &out.scope.held_out_px, &out.scope.held_out_mm, &out.fre_mm, &out.target_mm})
    *figure = figure->value_or(0);
  return out;
}

double registration_error_mm(double fre_mm, std::span<const Eigen::Vector3d> fiducials_mm,
                             const Eigen::Vector3d& target_mm) {
  const auto localisation = calibration::localisation_error_of(fre_mm, fiducials_mm.size());
  return calibration::TargetError(fiducials_mm, localisation.upper95_mm).rms_mm(target_mm);
}

double times_apart_s(Duration time_sigma, bool latency_known) {
  return std::hypot(time_sigma.seconds(), latency_known ? 0 : kUnknownLatency.seconds());
}

double ErrorBudget::rigid_mm() const {
  return std::sqrt(fiducials_mm * fiducials_mm + hand_eye_mm * hand_eye_mm + lens_mm * lens_mm + pose_mm * pose_mm +
                   time_mm * time_mm);
}

double ErrorBudget::rms_mm() const {
  return std::hypot(rigid_mm(), motion ? motion->rms_mm : 0);
}

double ErrorBudget::radius95_mm() const {
  // Two of three axes show in the picture; 5.99 is the 95 % quantile of chi-square with two degrees of freedom. A
  // deformation may be much less sure of one axis, which may lie across the picture: its radius is taken whole.
  return std::hypot(rigid_mm() * std::sqrt(5.99 / 3), motion ? motion->radius95_mm : 0);
}

std::optional<ErrorBudget> error_budget(const CameraModel& camera, const FramePose& pose, const TrustFigures& figures) {
  if (!figures.target_mm || !figures.scope.held_out_mm || !figures.target_in_patient_mm) return std::nullopt;
  const Eigen::Vector3d target_in_camera_mm = pose.camera_from_patient * *figures.target_in_patient_mm;
  ErrorBudget out;
  out.fiducials_mm = *figures.target_mm;
  const double hand_eye_mm = hand_eye_error_mm(camera, target_in_camera_mm, figures.scope);
  out.hand_eye_mm = of_few_stations(figures.scope) * hand_eye_mm;
  out.lens_mm = lens_error_mm(camera, target_in_camera_mm, figures.scope);
  // A pose's own sigma is an axis's, and counts what the hand may have done since; the jitter counts the angles.
  const double pose_mm = std::max(std::sqrt(3.0) * pose.position_sigma_mm, pose.jitter_mm.value_or(0));
  const double counted_mm = pose_in_hand_eye_mm(hand_eye_mm, target_in_camera_mm, figures.scope);
  out.pose_mm = std::sqrt(std::max(0.0, pose_mm * pose_mm - counted_mm * counted_mm));
  out.time_mm = pose.target_speed_mm_s.value_or(0) * times_apart_s(pose.time_sigma, pose.latency_known);
  out.motion = figures.motion_error;
  return out;
}

std::optional<TargetMark> target_mark(const CameraModel& camera, const FramePose& pose, const TrustFigures& figures) {
  const auto error = error_budget(camera, pose, figures);
  if (!error) return std::nullopt;
  const Eigen::Vector3d target_in_camera_mm = pose.camera_from_patient * *figures.target_in_patient_mm;
  const auto at_px = project(camera, target_in_camera_mm);
  if (!at_px || at_px->minCoeff() < 0 || at_px->x() >= camera.width_px || at_px->y() >= camera.height_px)
    return std::nullopt;
  // Far off the axis a lens model folds back into the picture.
  const auto ray = unproject(camera, *at_px);
  constexpr double kSameRay = 1e-3;
  if (!ray || (ray->head<2>() - target_in_camera_mm.head<2>() / target_in_camera_mm.z()).norm() > kSameRay)
    return std::nullopt;
  return TargetMark{*at_px, *error, error->radius95_mm() * camera.fx_px / target_in_camera_mm.z()};
}

}  // namespace birdseye::host
