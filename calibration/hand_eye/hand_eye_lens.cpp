#include "calibration/hand_eye/hand_eye_lens.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

CameraModel moved_lens(CameraModel lens, const CameraVector& step) {
  const CameraVector moved = parameters_of(lens) + step;
  set_parameters(lens, moved.data());
  return lens;
}

/// Hand-eye with the boards where this first lens puts them. Empty where a picture has no pose with it.
std::optional<ChainState> solved_with(const CameraModel& lens, const HandEyeStations& stations,
                                      const ChainFreedom& freedom, const ChainState& start, const RobustFit& robust,
                                      double sigma_px) {
  std::vector<SummedStation> summed = robust.summed;
  for (std::size_t i = 0; i < summed.size(); ++i) {
    std::vector<SeenCorners> corners = stations.used[i].corners.corners;
    corners.front().camera = &lens;
    const auto pose = refine_view_pose(corners, summed[i].camera_from_marker, sigma_px);
    if (!pose) return std::nullopt;
    summed[i].camera_from_marker = pose->camera_from_marker;
  }
  const ChainFit fit = fit_chain(summed, start, robust.noise, freedom, false);
  if (!fit.converged) return std::nullopt;
  return fit.state;
}

}  // namespace

void add_lens_error(const HandEyeInput& in, const HandEyeStations& stations, const ChainFreedom& freedom,
                    const ChainState& refined, const RobustFit& robust, HandEyeResult& out) {
  if (!in.camera_covariance || !in.camera || stations.used.front().corners.corners.empty()) return;
  const auto as_is = solved_with(*in.camera, stations, freedom, refined, robust, out.corner_sigma_px);
  if (!as_is) return;
  const Transform<Camera, Sensor>& from = as_is->camera_from_sensor;
  // In units in which each parameter's own sigma is 1: pixels and terms of distortion are no kin.
  const Eigen::VectorXd unit = in.camera_covariance->diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd per_unit = (unit.array() > 0).select(unit.cwiseInverse(), 0);
  const auto eigen = symmetric_eigen(
      Eigen::MatrixXd(per_unit.asDiagonal() * Eigen::MatrixXd(*in.camera_covariance) * per_unit.asDiagonal()));
  Matrix6d of_lens = Matrix6d::Zero();
  for (Eigen::Index k = 0; k < eigen.values.size(); ++k) {
    constexpr double kNothing = 1e-6;  // of one parameter's own variance
    if (!(eigen.values[k] > kNothing)) continue;
    const CameraVector step = std::sqrt(eigen.values[k]) * unit.cwiseProduct(eigen.vectors.col(k));
    const auto moved =
        solved_with(moved_lens(*in.camera, step), stations, freedom, *as_is, robust, out.corner_sigma_px);
    if (!moved) continue;
    const Transform<Camera, Sensor>& to = moved->camera_from_sensor;
    Vector6d change;
    change << rotation_log(Eigen::Matrix3d(to.rotation() * from.rotation().transpose())),
        to.translation() - from.translation();
    of_lens += change * change.transpose();
  }
  out.covariance += of_lens;
  out.of_lens_at_board_mm = out.sigma_at_board_mm(of_lens);
}

}  // namespace birdseye::calibration
