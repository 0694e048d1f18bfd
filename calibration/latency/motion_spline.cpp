#include "calibration/latency/motion_spline.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

namespace {

// A hand turns to and fro at most two or three times a second: at 2 Hz eight knots are a period, and the spline is
// wrong by a thousandth of the motion, to both sides alike.
constexpr double kSpacingS = 0.06;
constexpr double kFewestSamplesAKnot = 2;
// Holes wider than this are not looked into: the hand may have turned meanwhile.
constexpr double kMostGapS = 0.15, kMostGapPeriods = 3.5;

double median_interval_s(std::span<const double> times_s) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times_s.size(); ++i) intervals.push_back(times_s[i] - times_s[i - 1]);
  return median_of(std::move(intervals));
}

/// The four cubic B-splines that are not zero at u in [0, 1) of their knot interval, or their slopes by u.
Eigen::Vector4d basis(double u, int derivative) {
  if (derivative == 0) {
    const double v = 1 - u;
    return Eigen::Vector4d(v * v * v, 3 * u * u * u - 6 * u * u + 4, -3 * u * u * u + 3 * u * u + 3 * u + 1,
                           u * u * u) /
           6;
  }
  return Eigen::Vector4d(-(1 - u) * (1 - u), 3 * u * u - 4 * u, -3 * u * u + 2 * u + 1, u * u) / 2;
}

}  // namespace

SmoothingSpline::SmoothingSpline(std::span<const double> times_s, const Eigen::MatrixXd& values, double spacing_s)
    : begin_s_(times_s.front()) {
  const double span_s = times_s.back() - begin_s_;
  const auto intervals = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::ceil(span_s / spacing_s)));
  spacing_s_ = span_s / static_cast<double>(intervals);
  const Eigen::Index unknowns = intervals + 3, rows = values.rows();

  using Sparse = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double at = (times_s[static_cast<std::size_t>(i)] - begin_s_) / spacing_s_;
    const auto interval = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(at), 0, intervals - 1);
    const Eigen::Vector4d b = basis(at - static_cast<double>(interval), 0);
    for (int k = 0; k < 4; ++k) entries.emplace_back(i, interval + k, b[k]);
  }
  Sparse design(rows, unknowns);
  design.setFromTriplets(entries.begin(), entries.end());
  // Where a hole leaves knots without samples, the smoothest bridge; elsewhere too weak to be seen.
  constexpr double kStiffness = 1e-6;
  entries.clear();
  for (Eigen::Index k = 0; k + 2 < unknowns; ++k) {
    entries.emplace_back(k, k, 1);
    entries.emplace_back(k, k + 1, -2);
    entries.emplace_back(k, k + 2, 1);
  }
  Sparse bend(unknowns - 2, unknowns);
  bend.setFromTriplets(entries.begin(), entries.end());
  const Sparse stiffness = kStiffness * Sparse(bend.transpose() * bend);

  Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows);
  for (int round = 0; round < 3; ++round) {
    const Sparse normal = Sparse(design.transpose() * weights.asDiagonal() * design) + stiffness;
    const Eigen::SimplicialLDLT<Sparse> solver(normal);
    coefficients_ = solver.solve(Eigen::MatrixXd(design.transpose() * weights.asDiagonal() * values));
    const Eigen::VectorXd off = (values - design * coefficients_).rowwise().norm();
    constexpr double kUsual = 2.5;  // medians; beyond, a sample pulls no harder
    const double limit = kUsual * median_of({off.data(), off.data() + rows});
    for (Eigen::Index i = 0; i < rows; ++i) weights[i] = off[i] > limit && off[i] > 0 ? limit / off[i] : 1;
  }
}

Eigen::VectorXd SmoothingSpline::combine(double time_s, int derivative) const {
  const Eigen::Index intervals = coefficients_.rows() - 3;
  const double at = std::clamp((time_s - begin_s_) / spacing_s_, 0.0, static_cast<double>(intervals));
  const auto interval = std::min(static_cast<Eigen::Index>(at), intervals - 1);
  const Eigen::Vector4d b = basis(at - static_cast<double>(interval), derivative);
  const Eigen::VectorXd sum = coefficients_.middleRows(interval, 4).transpose() * b;
  return derivative == 0 ? sum : Eigen::VectorXd(sum / spacing_s_);
}

MotionSpline::MotionSpline(std::span<const Sample> samples) {
  const auto rows = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd quaternions(rows, 4), origins(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Sample& sample = samples[static_cast<std::size_t>(i)];
    times_s_.push_back(sample.time_s);
    quaternions.row(i) = sample.base_from_body.normalized().coeffs();
    // q and -q are one rotation; neighbours are to lie on one side.
    if (i > 0 && quaternions.row(i).dot(quaternions.row(i - 1)) < 0) quaternions.row(i) *= -1;
    origins.row(i) = sample.origin_in_base;
  }
  const double interval_s = median_interval_s(times_s_);
  const double spacing_s = std::max(kSpacingS, kFewestSamplesAKnot * interval_s);
  most_gap_s_ = std::max(kMostGapS, kMostGapPeriods * interval_s);
  quaternions_.emplace(times_s_, quaternions, spacing_s);
  origins_.emplace(times_s_, origins, spacing_s);
}

bool MotionSpline::covers(double time_s, double margin_s) const {
  if (time_s - margin_s < times_s_.front() || time_s + margin_s > times_s_.back()) return false;
  const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), time_s - margin_s);
  for (auto next = after; next != times_s_.end(); ++next) {
    if (*next - *(next - 1) > most_gap_s_) return false;
    if (*next > time_s + margin_s) break;
  }
  return true;
}

Eigen::Quaterniond MotionSpline::rotation_at(double time_s) const {
  const Eigen::Vector4d q = quaternions_->at(time_s);
  return Eigen::Quaterniond(q).normalized();
}

Eigen::Vector3d MotionSpline::turn_rate_at(double time_s) const {
  // omega = 2 q^-1 dq/dt, of which the length of q drops out.
  const Eigen::Quaterniond q(Eigen::Vector4d(quaternions_->at(time_s)));
  const Eigen::Quaterniond slope(Eigen::Vector4d(quaternions_->slope_at(time_s)));
  return 2 * (q.conjugate() * slope).vec() / q.squaredNorm();
}

Eigen::Vector3d MotionSpline::origin_at(double time_s) const {
  return origins_->at(time_s);
}

Eigen::Matrix<double, 6, 1> MotionSpline::step(double from_s, double to_s) const {
  const Eigen::Quaterniond from = rotation_at(from_s), to = rotation_at(to_s);
  Eigen::Matrix<double, 6, 1> step;
  step.head<3>() = rotation_log((from.conjugate() * to).toRotationMatrix());
  step.tail<3>() = rotation_at(0.5 * (from_s + to_s)).conjugate() * (origin_at(to_s) - origin_at(from_s));
  return step;
}

}  // namespace birdseye::calibration
