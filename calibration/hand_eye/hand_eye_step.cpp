#include "calibration/hand_eye/hand_eye_step.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

/// Fewer stations on one side tell a step from a bad pose too badly.
constexpr std::size_t kLeastOnASide = 4;
/// How often a calibration without any step may be told to have one, over all moments that are tried.
constexpr double kChance = 1e-3;

/// A change of hand-eye (first_parameter 0) or of the board's place (6) from some station on.
struct Step {
  double gain = 0;  ///< by how much it lessens the sum of squared, weighed residuals
  Vector6d change = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();  ///< of the change, of residuals of unit variance
};

/// Score test (C. Rao, 1948): what the fit with the step would gain, from derivatives at the fit without it. Along what
/// the stations do not tell there is no change.
Step step_of(const ChainNormal& all, const Eigen::MatrixXd& inverse, const ChainNormal& after, int first_parameter) {
  const Eigen::MatrixXd shared = after.information.middleRows(first_parameter, 6);
  const Vector6d gradient = after.gradient.segment<6>(first_parameter) - shared * inverse * all.gradient;
  const Matrix6d information =
      after.information.block<6, 6>(first_parameter, first_parameter) - shared * inverse * shared.transpose();
  // What is left of a direction after the fit of all stations, where that is so little, is rounding. Turns and shifts
  // are brought to one scale.
  constexpr double kRounding = 1e-9;
  const Vector6d scale = after.information.diagonal().segment<6>(first_parameter).cwiseSqrt();
  const Vector6d unit = scale.unaryExpr([](double s) { return s > 0 ? 1 / s : 0; });
  const auto own = symmetric_eigen(Eigen::MatrixXd(unit.asDiagonal() * information * unit.asDiagonal()));
  Step out;
  for (int i = 0; i < 6; ++i) {
    if (!(own.values[i] > kRounding)) continue;
    const Vector6d direction = unit.asDiagonal() * own.vectors.col(i);
    out.covariance += direction * direction.transpose() / own.values[i];
  }
  out.change = -out.covariance * gradient;
  out.gain = -gradient.dot(out.change);
  return out;
}

struct StepSize {
  double length = 0, sigma = 0;
};

/// Of a vector and, along it, its sigma.
StepSize size_of(const Eigen::Vector3d& v, const Eigen::Matrix3d& covariance) {
  const double length = v.norm();
  if (!(length > 0)) return {};
  const Eigen::Vector3d along = v / length;
  return {length, std::sqrt(std::max(0.0, along.dot(covariance * along)))};
}

}  // namespace

std::optional<HandEyeStep> find_step(const HandEyeInput& input, const HandEyeStations& stations,
                                     const ChainFreedom& freedom, const ChainState& state, const RobustFit& robust,
                                     double working_distance_mm) {
  const std::size_t count = robust.summed.size();
  if (count < 2 * kLeastOnASide || input.stations[stations.used.front().index].time_s) return std::nullopt;
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return stations.used[i].index; });
  const ChainNormal all = chain_normal(robust.summed, state, robust.noise, freedom, false);
  const Eigen::MatrixXd inverse = inverse_information(all.information);
  const double squares = 2 * all.cost - all.gradient.dot(inverse * all.gradient);
  const double left = freedom.of_residuals(count) - 6;  // residuals that the step leaves free
  if (!(left > 0)) return std::nullopt;
  const auto tried = static_cast<double>(2 * (count + 1 - 2 * kLeastOnASide));
  // Moments next to each other err alike, so that it is chance less often than that.
  const double limit = distance_limit(kChance / tried, left);
  // Against the noise that the step leaves, for it is part of the noise that was estimated; yet no tracker is better
  // than kLeastNoise.
  const double least = std::min(1.0, std::max(kLeastNoise.position_sigma_mm / robust.noise.position_sigma_mm,
                                              kLeastNoise.angle_sigma_rad / robust.noise.angle_sigma_rad));
  std::optional<HandEyeStep> out;
  double largest = limit;
  ChainNormal after{Eigen::MatrixXd::Zero(all.information.rows(), all.information.cols()),
                    Eigen::VectorXd::Zero(all.gradient.size()), 0};
  for (std::size_t n = count; n-- > kLeastOnASide;) {
    const ChainNormal one = chain_normal({&robust.summed[order[n]], 1}, state, robust.noise, freedom, false);
    after.information += one.information;
    after.gradient += one.gradient;
    if (count - n < kLeastOnASide) continue;
    for (const int first_parameter : {0, 6}) {
      const Step step = step_of(all, inverse, after, first_parameter);
      const double variance = std::max((squares - step.gain) / left, least * least);
      if (!(step.gain / variance > largest)) continue;
      largest = step.gain / variance;
      const bool of_sensor = first_parameter == 0;
      // Off by this where the board is, as in sigma_at_board_mm.
      const Eigen::Vector3d ahead(0, 0, working_distance_mm);
      const Eigen::Vector3d lever = of_sensor ? Eigen::Vector3d(ahead - state.camera_from_sensor.translation())
                                              : Eigen::Vector3d(Eigen::Vector3d::Zero());
      Eigen::Matrix<double, 3, 6> at_board;
      at_board << -cross_matrix(lever), Eigen::Matrix3d::Identity();
      const Matrix6d covariance = variance * step.covariance;
      const StepSize shift = size_of(at_board * step.change, at_board * covariance * at_board.transpose());
      const StepSize turn = size_of(step.change.head<3>(), covariance.topLeftCorner<3, 3>());
      out = HandEyeStep{input.stations[stations.used[order[n - 1]].index].name,
                        input.stations[stations.used[order[n]].index].name,
                        shift.length,
                        shift.sigma,
                        turn.length * kDegPerRad,
                        turn.sigma * kDegPerRad,
                        std::sqrt(largest),
                        std::sqrt(limit)};
    }
  }
  return out;
}

}  // namespace birdseye::calibration
