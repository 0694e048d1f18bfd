#include "calibration/points/pivot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "calibration/base/counted.hpp"
#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/points/pivot_covariance.hpp"
#include "calibration/points/pivot_tip.hpp"

namespace birdseye::calibration {

namespace {

using pivot::covariance_of, pivot::Indices, pivot::kSides, pivot::leaves_open, pivot::Poses, pivot::shaft_of,
    pivot::sides_of, pivot::solve, pivot::TipEquations;

constexpr std::size_t kLeastPoses = 4;
constexpr int kSamples = 500;  // where half of all poses are wrong, one of 16 samples of four has none of them
/// 2.5 deviations of a normal distribution in one dimension; in three the same share lies within 3.33.
constexpr double kOutlier = 3.33;

Eigen::Vector3d median_point(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d out;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Eigen::Vector3d& point : points) values.push_back(point[axis]);
    out[axis] = median_of(std::move(values));
  }
  return out;
}

/// Where each divot is by the median of the tip's places, which half of the poses may miss.
std::vector<Eigen::Vector3d> median_pivots(const Poses& poses, const Eigen::Vector3d& tip, std::size_t divots) {
  std::vector<std::vector<Eigen::Vector3d>> places(divots);
  for (const PivotPose& pose : poses) places[pose.divot].push_back(pose.tracker_from_sensor * tip);
  std::vector<Eigen::Vector3d> pivots;
  pivots.reserve(places.size());
  for (const auto& of_divot : places) pivots.push_back(median_point(of_divot));
  return pivots;
}

std::vector<double> residuals_of(const Poses& poses, const Eigen::Vector3d& tip,
                                 const std::vector<Eigen::Vector3d>& pivots) {
  std::vector<double> out;
  for (const PivotPose& pose : poses) out.push_back((pose.tracker_from_sensor * tip - pivots[pose.divot]).norm());
  return out;
}

PivotFit fit_of(const Poses& poses, const Indices& used, const TipEquations& linear) {
  PivotFit fit;
  fit.tip_in_sensor_mm = linear.tip;
  fit.pivots_in_tracker_mm = median_pivots(poses, linear.tip, linear.means.count.size());
  for (std::size_t k = 0; k < linear.means.count.size(); ++k) {
    if (linear.means.count[k] > 0) fit.pivots_in_tracker_mm[k] = linear.pivot(k);
  }
  const auto residuals = residuals_of(poses, linear.tip, fit.pivots_in_tracker_mm);
  double squares = 0;
  for (const std::size_t i : used) squares += residuals[i] * residuals[i];
  const auto count = static_cast<double>(used.size());
  fit.rms_mm = std::sqrt(squares / count);
  fit.component_rms_mm = std::sqrt(squares / (3 * count));
  return fit;
}

Indices inliers_of(const std::vector<double>& residuals, std::size_t unknowns) {
  // A length's median is 1.54 deviations of a coordinate; with few poses a fit is too good (P. Rousseeuw, 1984).
  const auto count = static_cast<double>(residuals.size());
  const double deviation =
      median_of(residuals) / 1.54 * (1 + 5 / std::max(1.0, count - static_cast<double>(unknowns) / 3));
  // What agrees to rounding has no outliers.
  constexpr double kRounding_mm = 1e-9;
  Indices inliers;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (residuals[i] <= kOutlier * deviation + kRounding_mm) inliers.push_back(i);
  }
  return inliers;
}

/// Moves count of the poses in from, drawn at random, to its front, and adds them to sample.
void draw(Indices& from, std::size_t count, std::mt19937& random, Indices& sample) {
  for (std::size_t k = 0; k < count; ++k) {
    std::swap(from[k], from[k + random() % (from.size() - k)]);
    sample.push_back(from[k]);
  }
}

/// Residuals of the best of many tips, each from four poses in one divot, or three in each of two: what one divot
/// leaves open another may tell.
std::vector<double> sample_residuals(const Poses& poses, std::size_t divots, const TipEquations& all) {
  std::vector<Indices> members(divots);
  for (std::size_t i = 0; i < poses.size(); ++i) members[poses[i].divot].push_back(i);
  std::erase_if(members, [](const Indices& of_divot) { return of_divot.size() < kLeastPoses; });
  std::vector<double> best = residuals_of(poses, all.tip, median_pivots(poses, all.tip, divots));
  double least = median_of(best);
  std::mt19937 random(1);  // a calibration repeated is the same calibration
  for (int n = 0; n < kSamples && !members.empty(); ++n) {
    const std::size_t one = random() % members.size(), other = random() % members.size();
    Indices sample;
    draw(members[one], one == other ? kLeastPoses : kLeastPoses - 1, random, sample);
    if (one != other) draw(members[other], kLeastPoses - 1, random, sample);
    const TipEquations linear = solve(poses, sample, divots);
    auto found = residuals_of(poses, linear.tip, median_pivots(poses, linear.tip, divots));
    if (const double median = median_of(found); median < least) {
      least = median;
      best = std::move(found);
    }
  }
  return best;
}

/// The poses that agree; all of them where fewer than a third of the poses do.
Indices agreeing(const Poses& poses, std::size_t divots, const TipEquations& all) {
  auto residuals = sample_residuals(poses, divots, all);
  const std::size_t unknowns = 3 + 3 * divots;
  Indices used;
  for (int round = 0; round < 30; ++round) {
    Indices inliers = inliers_of(residuals, unknowns);
    if (inliers == used) break;
    used = std::move(inliers);
    if (used.size() < std::max(kLeastPoses, poses.size() / 3)) {
      used.resize(poses.size());
      std::iota(used.begin(), used.end(), std::size_t{0});
      break;
    }
    const PivotFit fit = fit_of(poses, used, solve(poses, used, divots));
    residuals = residuals_of(poses, fit.tip_in_sensor_mm, fit.pivots_in_tracker_mm);
  }
  return used;
}

PivotTilt tilt_of(const Poses& poses, const Indices& used, const TipEquations& linear) {
  PivotTilt tilt;
  std::vector<Eigen::Vector3d> shafts;
  for (const PivotPose& pose : poses) shafts.emplace_back(pose.tracker_from_sensor.rotation() * shaft_of(linear.tip));
  double least_cosine = 1;
  for (const std::size_t a : used) {
    for (const std::size_t b : used) {
      if (b >= a) break;
      if (poses[a].divot == poses[b].divot) least_cosine = std::min(least_cosine, shafts[a].dot(shafts[b]));
    }
  }
  tilt.widest_deg = std::acos(std::clamp(least_cosine, -1.0, 1.0)) * kDegPerRad;
  const SymmetricEigen<3> eigen = symmetric_eigen(linear.normal);
  tilt.weakest_in_sensor = eigen.vectors.col(0);
  Eigen::Index largest = 0;
  tilt.weakest_in_sensor.cwiseAbs().maxCoeff(&largest);
  if (tilt.weakest_in_sensor[largest] < 0) tilt.weakest_in_sensor = -tilt.weakest_in_sensor;
  const double swing = std::sqrt(std::max(0.0, eigen.values[0]) / static_cast<double>(used.size()));
  tilt.weakest_swing_deg = std::asin(std::min(1.0, swing)) * kDegPerRad;
  return tilt;
}

double held_out_of(const Poses& poses, const Indices& used, const TipEquations& linear) {
  const auto sides = sides_of(poses, linear);
  double squares = 0, count = 0;
  for (int side = 0; side < kSides; ++side) {
    Indices rest;
    for (const std::size_t i : used) {
      if (sides[i] != side) rest.push_back(i);
    }
    if (rest.size() < kLeastPoses) continue;
    const TipEquations without = solve(poses, rest, linear.means.count.size());
    for (const std::size_t i : used) {
      if (sides[i] != side || without.means.count[poses[i].divot] == 0) continue;
      squares += (poses[i].tracker_from_sensor * without.tip - without.pivot(poses[i].divot)).squaredNorm();
      count += 1;
    }
  }
  return count > 0 ? std::sqrt(squares / count) : std::nan("");
}

void find_slide(const Poses& poses, const std::vector<Eigen::Vector3d>& offsets, std::size_t divots, Pivot& out) {
  constexpr std::size_t kLeastThird = 4;
  for (std::size_t k = 0; k < divots; ++k) {
    Indices members;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (poses[i].divot == k) members.push_back(i);
    }
    const std::size_t third = members.size() / 3;
    if (third < kLeastThird) continue;
    std::stable_sort(members.begin(), members.end(),
                     [&](std::size_t a, std::size_t b) { return poses[a].time_s < poses[b].time_s; });
    std::vector<Eigen::Vector3d> first, last;
    std::vector<double> scatter;
    for (std::size_t n = 0; n < third; ++n) {
      first.push_back(offsets[members[n]]);
      last.push_back(offsets[members[members.size() - 1 - n]]);
    }
    const Eigen::Vector3d from = median_point(first), to = median_point(last);
    for (std::size_t n = 0; n < third; ++n) {
      scatter.push_back((first[n] - from).norm());
      scatter.push_back((last[n] - to).norm());
    }
    const double slid_mm = (to - from).norm();
    if (slid_mm < out.slid_mm) continue;
    out.slid_mm = slid_mm;
    out.slid_divot = k;
    // A median's variance is 1.57 of a mean's.
    out.slid_sigma_mm = median_of(scatter) / 1.54 * std::sqrt(2 * 1.57 / static_cast<double>(third));
  }
}

bool less(const PivotPose& a, const PivotPose& b) {
  if (a.divot != b.divot) return a.divot < b.divot;
  const Eigen::Matrix4d x = a.tracker_from_sensor.matrix(), y = b.tracker_from_sensor.matrix();
  return std::lexicographical_compare(x.data(), x.data() + 16, y.data(), y.data() + 16);
}

}  // namespace

Result<Pivot> solve_pivot(std::span<const PivotPose> given) {
  if (given.size() < kLeastPoses) {
    return Error{Errc::degenerate, fmt::format("{}: a pivot needs at least {}, tilted to several sides",
                                               counted(given.size(), "pose", "poses"), kLeastPoses)};
  }
  std::size_t divots = 0;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!given[i].tracker_from_sensor.matrix().allFinite())
      return Error{Errc::bad_value, fmt::format("pose {} has a number that is not finite", i + 1)};
    divots = std::max(divots, given[i].divot + 1);
  }
  // Sums and samples in an order that the poses themselves give.
  Indices order(given.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return less(given[a], given[b]); });
  Poses poses;
  for (const std::size_t i : order) poses.push_back(given[i]);
  Pivot out;
  for (std::size_t i = 0; i < poses.size(); ++i) out.distinct_poses += i == 0 || less(poses[i - 1], poses[i]) ? 1 : 0;

  Indices all(poses.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const TipEquations algebraic = solve(poses, all, divots);
  out.algebraic = fit_of(poses, all, algebraic);
  const Indices used = agreeing(poses, divots, algebraic);
  const TipEquations linear = solve(poses, used, divots);
  out.robust = fit_of(poses, used, linear);
  out.tip_covariance_mm2 = covariance_of(poses, used, linear);
  if (leaves_open(linear, used.size())) {
    out.tip_covariance_mm2.setConstant(std::numeric_limits<double>::infinity());
    out.tip_sigma_mm = std::numeric_limits<double>::infinity();
  } else {
    out.tip_sigma_mm = std::sqrt(std::max(0.0, symmetric_eigenvalues(out.tip_covariance_mm2)[2]));
  }
  out.tilt = tilt_of(poses, used, linear);
  out.held_out_mm = held_out_of(poses, used, linear);
  std::vector<Eigen::Vector3d> offsets;
  for (const PivotPose& pose : poses)
    offsets.emplace_back(pose.tracker_from_sensor * linear.tip - out.robust.pivots_in_tracker_mm[pose.divot]);
  find_slide(poses, offsets, divots, out);
  // Back to the order in which the poses were given.
  out.offsets_mm.resize(given.size());
  out.residuals_mm.resize(given.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    out.offsets_mm[order[i]] = offsets[i];
    out.residuals_mm[order[i]] = offsets[i].norm();
    if (!std::binary_search(used.begin(), used.end(), i)) out.outliers.push_back(order[i]);
  }
  std::sort(out.outliers.begin(), out.outliers.end());
  return out;
}

}  // namespace birdseye::calibration
