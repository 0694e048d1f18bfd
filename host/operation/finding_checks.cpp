#include "host/operation/finding_checks.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rigid_matrix.hpp"

namespace birdseye::host {

namespace {

Result<void> check_figure(const char* name, const std::optional<double>& figure) {
  if (!figure || is_measured_error(*figure)) return {};
  return Error{Errc::bad_value, fmt::format("{} is {:g}, which no measurement gives", name, *figure)};
}

template <typename Matrix>
Result<void> check_covariance(const char* name, const std::optional<Matrix>& covariance) {
  if (!covariance || is_covariance(*covariance)) return {};
  return Error{Errc::bad_value, fmt::format("{} is no covariance", name)};
}

}  // namespace

Result<void> check_figures(const CalibratedScope& found) {
  const ScopeFigures& figures = found.scope.figures();
  if (auto sound = check_figure("camera_rms_px", figures.camera_rms_px); !sound) return sound;
  if (auto sound = check_figure("held_out_px", figures.held_out_px); !sound) return sound;
  if (auto sound = check_figure("held_out_mm", figures.held_out_mm); !sound) return sound;
  if (auto sound = check_covariance("the lens's covariance", found.scope.camera_covariance()); !sound) return sound;
  if (auto sound = check_covariance("hand_eye_covariance", figures.hand_eye_covariance); !sound) return sound;
  constexpr int kMostStations = 100'000;
  if (const auto& stations = figures.hand_eye_stations; stations && (*stations < 1 || *stations > kMostStations))
    return Error{Errc::bad_value, fmt::format("hand_eye_stations is {}, which nobody measures", *stations)};
  return {};
}

Result<void> check_figures(const RegisteredPatient& found) {
  for (const PlaceOff& place : found.off)
    if (auto sound = check_figure("off_mm", place.off_mm); !sound) return sound;
  constexpr double kLeastSpread_mm = 1;
  if (auto sound = check_figure("fre_mm", found.fre_mm); !sound) return sound;
  const auto& places = found.fiducials_in_patient_mm;
  if (places.size() < 3) return Error{Errc::bad_value, "names fewer than three fiducials"};
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = places[i];
  if (!all.allFinite() || all.cwiseAbs().maxCoeff() > kFarthestMm)
    return Error{Errc::bad_value, fmt::format("has a fiducial farther than {:.0f} m away", kFarthestMm / 1000)};
  all.colwise() -= all.rowwise().mean().eval();
  const Eigen::Vector3d spread_mm = Eigen::JacobiSVD<Eigen::Matrix3Xd>(all).singularValues().head<3>();
  if (spread_mm[1] < kLeastSpread_mm)
    return Error{Errc::bad_value, "has all its fiducials at one place, or on one line: nothing is registered by these"};
  return {};
}

Result<void> check_figures(const DeformedOrgan& found) {
  if (auto sound = check_figure("seen_rms_mm", found.seen_rms_mm); !sound) return sound;
  if (!found.target) return {};
  const MotionError& target = *found.target;
  if (auto sound = check_figure("the target's radius95_mm", target.radius95_mm); !sound) return sound;
  // Of a normal distribution the radius is the larger, by 1.6 to 2.0 times.
  if (target.rms_mm >= 0 && target.radius95_mm >= target.rms_mm) return {};
  return Error{Errc::bad_value,
               fmt::format("the target's rms_mm is {:g} and its radius95_mm {:g}, which do not go together",
                           target.rms_mm, target.radius95_mm)};
}

Result<void> check_figures(const std::vector<NamedPoint>& landmarks) {
  for (const NamedPoint& landmark : landmarks) {
    if (!landmark.place_mm.allFinite() || landmark.place_mm.cwiseAbs().maxCoeff() > kFarthestMm)
      return Error{Errc::bad_value, fmt::format("has a landmark farther than {:.0f} m away", kFarthestMm / 1000)};
  }
  return {};
}

}  // namespace birdseye::host
