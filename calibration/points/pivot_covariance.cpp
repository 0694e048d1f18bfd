#include "calibration/points/pivot_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calibration/base/student95.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration::pivot {

namespace {

/// The share of a normal distribution's variance in three dimensions that lies within: P(chi2_5 < k^2)/P(chi2_3 < k^2).
constexpr double kVarianceWithin = 0.961;
/// A few poses tell their own covariance so badly that it is drawn towards the one of poses that err alike, as if so
/// many more poses had told that.
constexpr double kAlikePoses = 6;
constexpr std::size_t kLeastGroups = 5;  // fewer say too little about how groups differ

/// The tip's covariance if all poses erred alike, in all directions.
Eigen::Matrix3d alike_covariance(const Poses& poses, const Indices& used, const TipEquations& linear) {
  double squares = 0;
  for (const std::size_t i : used)
    squares += (poses[i].tracker_from_sensor * linear.tip - linear.pivot(poses[i].divot)).squaredNorm();
  const double freedom = 3 * (static_cast<double>(used.size()) - 1 - static_cast<double>(linear.means.count.size()));
  return squares / std::max(1.0, freedom) / kVarianceWithin * linear.inverse;
}

/// White's covariance of the tip, each residual as it would be had the fit not seen its pose (J. MacKinnon and H.
/// White, 1985): with few poses it is too small otherwise. Drawn towards the one of poses that err alike, in the ratio
/// of the poses to kAlikePoses.
Eigen::Matrix3d independent_covariance(const Poses& poses, const Indices& used, const TipEquations& linear) {
  Eigen::Matrix3d scores = Eigen::Matrix3d::Zero();
  for (const std::size_t i : used) {
    const auto& pose = poses[i].tracker_from_sensor;
    const std::size_t divot = poses[i].divot;
    const Eigen::Matrix3d swing = pose.rotation() - linear.means.rotation[divot];
    const Eigen::Matrix3d unseen =
        (1 - 1 / linear.means.count[divot]) * Eigen::Matrix3d::Identity() - swing * linear.inverse * swing.transpose();
    const Eigen::Vector3d residual = pose * linear.tip - linear.pivot(divot);
    // A pose that alone tells some part of the tip has no residual there.
    const Eigen::Vector3d score = swing.transpose() * solve_least_norm(unseen, residual);
    scores += score * score.transpose();
  }
  const Eigen::Matrix3d white = linear.inverse * scores * linear.inverse / kVarianceWithin;
  const auto count = static_cast<double>(used.size());
  return (count * white + kAlikePoses * alike_covariance(poses, used, linear)) / (count + kAlikePoses);
}

/// Which poses may err alike: those of a divot, where there are divots enough, or those that lean to one side. A field
/// that metal bends errs alike there, however many poses there are.
std::vector<std::size_t> places_of(const Poses& poses, const TipEquations& linear) {
  std::vector<std::size_t> groups;
  if (linear.means.count.size() >= kLeastGroups) {
    for (const PivotPose& pose : poses) groups.push_back(pose.divot);
  } else {
    for (const int side : sides_of(poses, linear)) groups.push_back(static_cast<std::size_t>(side));
  }
  return groups;
}

/// The same for neighbours in time, which a tracker's filter and a hand that leans on one side push alike. All poses in
/// one group where they have no times.
std::vector<std::size_t> moments_of(const Poses& poses) {
  constexpr std::size_t kMoments = 12;
  Indices order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return poses[i].time_s; });
  std::vector<std::size_t> groups(poses.size(), 0);
  if (poses[order.front()].time_s == poses[order.back()].time_s) return groups;
  for (std::size_t k = 0; k < order.size(); ++k) groups[order[k]] = k * kMoments / order.size();
  return groups;
}

/// The tip's variance where the errors of all poses of a group may be one, mm^2 summed over the axes, as much larger as
/// a 95 % bound by so few groups has to be. 0 where groups are too few to tell.
double variance_between(const Poses& poses, const Indices& used, const TipEquations& linear,
                        const std::vector<std::size_t>& groups) {
  std::vector<Eigen::Vector3d> sums(*std::ranges::max_element(groups) + 1, Eigen::Vector3d::Zero());
  if (sums.size() < kLeastGroups) return 0;
  for (const std::size_t i : used) {
    const auto& pose = poses[i].tracker_from_sensor;
    const Eigen::Matrix3d swing = pose.rotation() - linear.means.rotation[poses[i].divot];
    sums[groups[i]] += swing.transpose() * (pose * linear.tip - linear.pivot(poses[i].divot));
  }
  double squares = 0;
  for (const Eigen::Vector3d& sum : sums) squares += (linear.inverse * sum).squaredNorm();
  const auto count = static_cast<double>(sums.size());
  const double few = few_groups_factor(sums.size());
  return few * few * count / (count - 1) * squares;
}

/// How much larger a covariance in three dimensions that rests on so few poses has to be for its 95 % region to hold
/// the truth: Hotelling's limit (H. Hotelling, 1931) over chi squared's, to two parts in a thousand from 10 to 120. A
/// pose's residual counts once, for it says in one direction how far off the tip is; one that errs alike in all
/// directions, more than once.
double few_poses(std::size_t poses, std::size_t divots) {
  const double left = std::max(1.0, static_cast<double>(poses) - static_cast<double>(divots) - 4 + 2 * kAlikePoses);
  return 1 + (5.35 + 17 / left) / left;
}

}  // namespace

Eigen::Matrix3d covariance_of(const Poses& poses, const Indices& used, const TipEquations& linear) {
  Eigen::Matrix3d independent = independent_covariance(poses, used, linear);
  const double alone_mm2 = independent.trace();
  if (!(alone_mm2 > 0)) return independent;
  double times = 1;
  for (const auto& groups : {places_of(poses, linear), moments_of(poses)})
    times += std::max(0.0, variance_between(poses, used, linear, groups) / alone_mm2 - 1);
  return few_poses(used.size(), linear.means.count.size()) * times * independent;
}

}  // namespace birdseye::calibration::pivot
