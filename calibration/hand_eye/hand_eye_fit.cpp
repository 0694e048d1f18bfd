#include "calibration/hand_eye/hand_eye_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/base/median.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

struct LinearisedResidual {
  Vector6d residual;
  Matrix6Xd by_parameter;
  Matrix6d covariance;
};

LinearisedResidual linearise(const SummedStation& station, const ChainState& state, const TrackerNoise& noise,
                             const ChainFreedom& freedom) {
  const ChainResidual r = chain_residual(station.chain, station.camera_from_marker, state);
  LinearisedResidual out{r.value, Matrix6Xd(6, freedom.parameters()),
                         chain_covariance(station.chain, noise) +
                             r.by_camera_from_marker * station.view_covariance * r.by_camera_from_marker.transpose()};
  out.by_parameter.leftCols<6>() = r.by_hand_eye;
  out.by_parameter.middleCols<6>(6) = r.by_body_from_marker;
  int column = 12;
  if (freedom.time_offset) out.by_parameter.col(column++) = r.by_time_offset;
  if (freedom.board_scale) out.by_parameter.col(column++) = r.by_board_scale;
  return out;
}

double robust_cost(double squared) {
  return 0.5 * (kRobustFreedom + 6) * std::log1p(squared / kRobustFreedom);
}

/// Cost at a state, weighed by the covariances of another.
double cost_at(std::span<const SummedStation> stations, const ChainState& state, const std::vector<Matrix6d>& weights,
               bool robust) {
  double cost = 0;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const Vector6d r = chain_residual(stations[i].chain, stations[i].camera_from_marker, state).value;
    const double squared = r.dot(weights[i] * r);
    cost += robust ? robust_cost(squared) : 0.5 * squared;
  }
  return cost;
}

ChainState stepped(const ChainState& state, const Eigen::VectorXd& step, const ChainFreedom& freedom) {
  ChainState out = state;
  out.camera_from_sensor = moved(state.camera_from_sensor, step.head<6>());
  out.body_from_marker = moved(state.body_from_marker, step.segment<6>(6));
  int at = 12;
  if (freedom.time_offset) out.time_offset_s += step[at++];
  if (freedom.board_scale) out.board_scale += step[at++];
  return out;
}

ChainNormal normal_at(std::span<const SummedStation> stations, const ChainState& state, const TrackerNoise& noise,
                      const ChainFreedom& freedom, bool robust, std::vector<Matrix6d>* weights) {
  const int size = freedom.parameters();
  ChainNormal out{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
  for (const SummedStation& station : stations) {
    const LinearisedResidual at = linearise(station, state, noise, freedom);
    const Matrix6d weight = inverse_symmetric(at.covariance);
    const double squared = at.residual.dot(weight * at.residual);
    const double down = robust ? (kRobustFreedom + 6) / (kRobustFreedom + squared) : 1;
    const Matrix6Xd weighted = down * weight * at.by_parameter;
    out.information.noalias() += at.by_parameter.transpose() * weighted;
    out.gradient.noalias() += weighted.transpose() * at.residual;
    out.cost += robust ? robust_cost(squared) : 0.5 * squared;
    if (weights != nullptr) weights->push_back(weight);
  }
  return out;
}

Eigen::VectorXd solve_damped(const ChainNormal& normal, double damping) {
  Eigen::MatrixXd information = normal.information;
  information.diagonal() *= 1 + damping;
  return -inverse_information(information) * normal.gradient;
}

/// Position's sigma over the angle's: 206 mm of the miniBIRD (1.8 mm, 0.5 deg), some 150 mm of optical trackers
/// (0.25 mm, 0.1 deg). As 1.5 working distances of a laparoscope, so that no unit enters.
double noise_arm_mm(std::span<const SummedStation> stations) {
  constexpr double kWorkingDistances = 1.5;
  double squares = 0;
  for (const SummedStation& s : stations) {
    squares += s.camera_from_marker.translation().squaredNorm();
  }
  return kWorkingDistances * std::sqrt(squares / static_cast<double>(stations.size()));
}

}  // namespace

ChainNormal chain_normal(std::span<const SummedStation> stations, const ChainState& state, const TrackerNoise& noise,
                         const ChainFreedom& freedom, bool robust) {
  return normal_at(stations, state, noise, freedom, robust, nullptr);
}

ChainFit fit_chain(std::span<const SummedStation> stations, const ChainState& start, const TrackerNoise& noise,
                   const ChainFreedom& freedom, bool robust) {
  constexpr int kIterations = 200;
  // Of the last step against its own sigma, squared: the next would be far smaller, so that the way there does not
  // show.
  constexpr double kSmallStep = 1e-20;
  // A step so small that lessens nothing any more is rounding: residuals far below the noise of doubles' differences.
  constexpr double kRounding = 1e-8;
  ChainFit out;
  out.state = start;
  double damping = robust ? 1e-3 : 1e-9;
  ChainNormal normal;
  for (int i = 0; i < kIterations && !out.converged; ++i) {
    std::vector<Matrix6d> weights;
    normal = normal_at(stations, out.state, noise, freedom, robust, &weights);
    out.cost_trace.push_back(normal.cost);
    bool first = true;
    bool stalled = false;
    for (;;) {
      const Eigen::VectorXd step = solve_damped(normal, damping);
      if (!step.allFinite()) return out;
      const double size = step.dot(normal.information * step);
      const bool small = size < kSmallStep;
      if (first) stalled = size < kRounding;
      first = false;
      const ChainState tried = stepped(out.state, step, freedom);
      if (small || cost_at(stations, tried, weights, robust) <= normal.cost * (1 + 1e-12)) {
        out.state = tried;
        out.converged = small;
        damping = std::max(damping * 0.1, 1e-15);
        break;
      }
      damping = std::max(10 * damping, 1e-9);
      if (damping > 1e10 && !stalled) return out;
      if (damping > 1e10) {
        out.converged = true;
        break;
      }
    }
    if (i + 1 == kIterations) out.converged = out.converged || stalled;
  }
  out.covariance = (robust ? kRobustCovariance : 1) * inverse_information(normal.information);
  for (const SummedStation& s : stations)
    out.residuals.push_back(chain_residual(s.chain, s.camera_from_marker, out.state).value);
  return out;
}

TrackerNoise median_noise(std::span<const Vector6d> residuals, const ChainFreedom& freedom) {
  constexpr double kMedianOfThree = 2.366;  // of chi squared with three degrees of freedom
  std::vector<double> turns, shifts;
  for (const Vector6d& r : residuals) {
    turns.push_back(r.head<3>().squaredNorm());
    shifts.push_back(r.tail<3>().squaredNorm());
  }
  const double count = 6.0 * static_cast<double>(residuals.size());
  const double for_fit = count / std::max(3.0, count - freedom.parameters());
  return {std::max(kLeastNoise.position_sigma_mm, std::sqrt(for_fit * median_of(shifts) / kMedianOfThree)),
          std::max(kLeastNoise.angle_sigma_rad, std::sqrt(for_fit * median_of(turns) / kMedianOfThree))};
}

TrackerNoise estimate_noise(std::span<const SummedStation> stations, ChainFit& fit, TrackerNoise noise,
                            const ChainFreedom& freedom) {
  constexpr int kRounds = 200;
  const double arm_mm = noise_arm_mm(stations);
  for (int round = 0; round < kRounds; ++round) {
    fit = fit_chain(stations, fit.state, noise, freedom, false);
    if (!fit.converged) return noise;
    // tr(P G) = r^T V^-1 G V^-1 r for each variance's shape G, P being V^-1 less what the fit takes up.
    double position_trace = 0, angle_trace = 0, position_squares = 0, angle_squares = 0;
    for (const SummedStation& station : stations) {
      const LinearisedResidual at = linearise(station, fit.state, noise, freedom);
      const Matrix6d weight = inverse_symmetric(at.covariance);
      const Matrix6Xd weighted = weight * at.by_parameter;
      const Matrix6d left = weight - weighted * fit.covariance * weighted.transpose();
      const Vector6d r = weight * at.residual;
      const Matrix6d position = position_noise_shape(station.chain);
      const Matrix6d angle = angle_noise_shape(station.chain);
      position_trace += (left * position).trace();
      angle_trace += (left * angle).trace();
      position_squares += r.dot(position * r);
      angle_squares += r.dot(angle * r);
    }
    const double p2 = noise.position_sigma_mm * noise.position_sigma_mm,
                 a2 = noise.angle_sigma_rad * noise.angle_sigma_rad;
    // Variances by the residuals, the position's in units of the angle's, and how many residuals each rests on.
    const double p = p2 * position_squares / std::max(1e-300, position_trace) / (arm_mm * arm_mm);
    const double a = a2 * angle_squares / std::max(1e-300, angle_trace);
    const double p_freedom = p2 * position_trace, a_freedom = a2 * angle_trace;
    const double pooled = (p_freedom * p + a_freedom * a) / (p_freedom + a_freedom);
    const auto drawn = [&](double variance, double count) {
      return (count * variance + kNoisePriorFreedom * pooled) / (count + kNoisePriorFreedom);
    };
    const TrackerNoise next{std::max(kLeastNoise.position_sigma_mm, arm_mm * std::sqrt(drawn(p, p_freedom))),
                            std::max(kLeastNoise.angle_sigma_rad, std::sqrt(drawn(a, a_freedom)))};
    const double change = std::abs(next.position_sigma_mm / noise.position_sigma_mm - 1) +
                          std::abs(next.angle_sigma_rad / noise.angle_sigma_rad - 1);
    noise = next;
    if (change < 1e-13) break;
  }
  fit = fit_chain(stations, fit.state, noise, freedom, false);
  return noise;
}

std::optional<FitWithout> fit_without(std::span<const SummedStation> stations, std::span<const std::size_t> left_out,
                                      const ChainFit& fit, const TrackerNoise& noise, const ChainFreedom& freedom,
                                      bool robust) {
  // From the optimum of all, one step is exact to first order; a second makes it so to the third.
  constexpr int kSteps = 2;
  std::vector<SummedStation> others;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    if (!std::ranges::binary_search(left_out, i)) others.push_back(stations[i]);
  }
  FitWithout out{fit.state, {}};
  for (int i = 0; i < kSteps; ++i) {
    const ChainNormal normal = chain_normal(others, out.state, noise, freedom, robust);
    out.covariance = inverse_information(normal.information);
    const Eigen::VectorXd step = -out.covariance * normal.gradient;
    if (!step.allFinite()) return std::nullopt;
    out.state = stepped(out.state, step, freedom);
  }
  if (robust) out.covariance *= kRobustCovariance;
  return out;
}

double distance_squared(const SummedStation& station, const FitWithout& without, const TrackerNoise& noise,
                        const ChainFreedom& freedom) {
  const LinearisedResidual left_out = linearise(station, without.state, noise, freedom);
  const Matrix6d predicted =
      left_out.covariance + left_out.by_parameter * without.covariance * left_out.by_parameter.transpose();
  const double squared = left_out.residual.dot(solve_symmetric(predicted, left_out.residual));
  return squared >= 0 ? squared : std::numeric_limits<double>::infinity();
}

double distance_limit(double exceeded_with, double freedom) {
  // With six and n degrees of freedom the tail has a closed form in y = n / (n + 6 F):
  // P(F > f) = y^(n/2) (1 + (n/2)(1-y) + (n/2)(n/2+1)/2 (1-y)^2).
  const double half = 0.5 * std::max(1.0, freedom);
  double low = 1e-3, high = 1e9;
  for (int i = 0; i < 200; ++i) {
    const double middle = std::sqrt(low * high);
    const double y = 2 * half / (2 * half + middle);
    const double tail = std::pow(y, half) * (1 + half * (1 - y) + 0.5 * half * (half + 1) * (1 - y) * (1 - y));
    (tail > exceeded_with ? low : high) = middle;
  }
  return low;
}

}  // namespace birdseye::calibration
