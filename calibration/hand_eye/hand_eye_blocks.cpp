#include "calibration/hand_eye/hand_eye_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kBlocks = 12;
constexpr std::size_t kFewestBlocks = 6;  // fewer tell no spread in six directions
constexpr std::size_t kFewestStationsInBlock = 2;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

constexpr double kPriorFreedom = 8;  // of the independent covariance's shape

/// The stations that are used in the order of their times, if all have one.
std::vector<std::size_t> order_in_time(const HandEyeInput& in, const HandEyeStations& stations) {
  const auto time_of = [&](std::size_t i) { return in.stations[stations.used[i].index].time_s; };
  std::vector<std::size_t> order(stations.used.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!std::ranges::all_of(order, [&](std::size_t i) { return time_of(i).has_value(); })) return {};
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return *time_of(i); });
  return order;
}

/// What leads from one state's hand-eye to another's, and the time offset's change.
Vector7d change(const ChainState& from, const ChainState& to) {
  const auto& a = from.camera_from_sensor;
  const auto& b = to.camera_from_sensor;
  Vector7d out;
  out << rotation_log(Eigen::Matrix3d(b.rotation() * a.rotation().transpose())), b.translation() - a.translation(),
      to.time_offset_s - from.time_offset_s;
  return out;
}

/// A station's pose as six lengths: what its turn does at the board's distance, and where the board is.
Eigen::MatrixXd poses_of(const HandEyeStations& stations) {
  Eigen::MatrixXd out(6, stations.used.size());
  const auto& first = stations.used.front().summed.camera_from_marker;
  for (std::size_t i = 0; i < stations.used.size(); ++i) {
    const auto& view = stations.used[i].summed.camera_from_marker;
    const Eigen::Vector3d turn = rotation_log(Eigen::Matrix3d(view.rotation() * first.rotation().transpose()));
    out.col(static_cast<Eigen::Index>(i)) << view.translation().norm() * turn, view.translation();
  }
  return out;
}

/// Numbers the stations of indices from `first` on, by halving where they are spread most, until there are so many
/// blocks.
void halve(const Eigen::MatrixXd& poses, std::span<std::size_t> indices, std::size_t first, std::size_t blocks,
           std::vector<std::size_t>& block_of) {
  if (blocks == 1) {
    for (const std::size_t i : indices) block_of[i] = first;
    return;
  }
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(6), squares = sum;
  for (const std::size_t i : indices) {
    const Eigen::VectorXd pose = poses.col(static_cast<Eigen::Index>(i));
    sum += pose;
    squares += pose.cwiseAbs2();
  }
  Eigen::Index axis = 0;
  (squares - sum.cwiseAbs2() / static_cast<double>(indices.size())).maxCoeff(&axis);
  std::ranges::sort(indices, {}, [&](std::size_t i) { return poses(axis, static_cast<Eigen::Index>(i)); });
  const std::size_t of_first = blocks / 2;
  const std::size_t cut = indices.size() * of_first / blocks;
  halve(poses, indices.first(cut), first, of_first, block_of);
  halve(poses, indices.subspan(cut), first + of_first, blocks - of_first, block_of);
}

HandEyeBlocks fitted(std::vector<std::size_t> block_of, const ChainFreedom& freedom, const ChainState& refined,
                     const RobustFit& robust) {
  HandEyeBlocks out{std::move(block_of), {}};
  ChainFit fit = robust.fit;
  fit.state = refined;
  const std::size_t blocks = *std::ranges::max_element(out.block_of) + 1;
  for (std::size_t block = 0; block < blocks; ++block) {
    std::vector<std::size_t> left_out;
    for (std::size_t i = 0; i < out.block_of.size(); ++i) {
      if (out.block_of[i] == block) left_out.push_back(i);
    }
    out.without.push_back(fit_without(robust.summed, left_out, fit, robust.noise, freedom, false));
  }
  return out;
}

/// The jackknife's covariance of hand-eye and the time offset.
Matrix7d spread_of(const HandEyeBlocks& blocks, const ChainState& refined) {
  std::vector<Vector7d> changes;
  for (const auto& without : blocks.without) {
    if (without) changes.push_back(change(refined, without->state));
  }
  const auto count = static_cast<double>(changes.size());
  Vector7d mean = Vector7d::Zero();
  for (const Vector7d& c : changes) mean += c / count;
  Matrix7d spread = Matrix7d::Zero();
  for (const Vector7d& c : changes) spread += (count - 1) / count * (c - mean) * (c - mean).transpose();
  return spread;
}

/// Each eigenvalue at least 1: less than what independent residuals leave is chance.
Matrix6d at_least_one(const Matrix6d& whitened) {
  const auto eigen = symmetric_eigen(Eigen::MatrixXd(whitened));
  return eigen.vectors * eigen.values.cwiseMax(1).asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

CorrelatedStations fit_without_blocks(const HandEyeInput& in, const HandEyeStations& stations,
                                      const ChainFreedom& freedom, const ChainState& refined, const RobustFit& robust) {
  const std::size_t count = stations.used.size();
  std::vector<std::size_t> block_of(count);
  std::iota(block_of.begin(), block_of.end(), std::size_t{0});
  std::vector<std::size_t> in_time = order_in_time(in, stations);
  const std::size_t blocks = std::min(kBlocks, in_time.size() / kFewestStationsInBlock);
  if (blocks < kFewestBlocks) return {fitted(std::move(block_of), freedom, refined, robust), std::nullopt};
  for (std::size_t i = 0; i < count; ++i) block_of[in_time[i]] = i * blocks / count;
  CorrelatedStations out{fitted(block_of, freedom, refined, robust), std::nullopt};
  halve(poses_of(stations), in_time, 0, blocks, block_of);
  out.in_pose = fitted(std::move(block_of), freedom, refined, robust);
  return out;
}

void widen_by_blocks(const CorrelatedStations& blocks, const ChainState& refined, HandEyeResult& out) {
  if (!blocks.in_pose) return;
  const Matrix7d in_time = spread_of(blocks.in_time, refined), in_pose = spread_of(*blocks.in_pose, refined);
  const Matrix6d white = whitening(out.covariance);
  const auto whitened = [&](const Matrix7d& spread) -> Matrix6d {
    return white * spread.topLeftCorner<6, 6>() * white.transpose();
  };
  // What both ways hold is counted once: neighbours in time and pose, which are nearly the stations one by one.
  const Matrix6d of_blocks = at_least_one(whitened(in_time) + whitened(in_pose) - Matrix6d::Identity());
  const double own = static_cast<double>(blocks.in_time.without.size()) - 1;
  const double freedom = own + kPriorFreedom;
  const Matrix6d drawn = (own * of_blocks + kPriorFreedom * of_blocks.trace() / 6 * Matrix6d::Identity()) / freedom;
  const Matrix6d back = white.inverse();
  out.covariance = back * drawn * back.transpose();
  const double offset_variance = in_time(6, 6) + in_pose(6, 6) - std::pow(out.time_offset_sigma_s, 2);
  out.time_offset_sigma_s = std::max(out.time_offset_sigma_s, std::sqrt(std::max(0.0, offset_variance)));
  // Hotelling's T squared in six dimensions.
  out.region_limit = freedom / (freedom - 5) * distance_limit(kOutsideRegion, freedom - 5);
}

}  // namespace birdseye::calibration
