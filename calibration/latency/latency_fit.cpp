#include "calibration/latency/latency_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/base/student95.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kMostRounds = 30;
constexpr double kDoneS = 1e-7;
constexpr double kUsual = 2.5;    // medians of the residuals' lengths: beyond, a sample pulls no harder (Huber)
constexpr double kOutlier = 6.0;  // and beyond this not at all
constexpr double kPartS = 1;      // hands, filters and splines forget within that
constexpr int kFewestParts = 8, kMostParts = 60;

/// One weight a sample, by the length of its residual.
Eigen::VectorXd weights_of(const Eigen::VectorXd& lengths) {
  const double middle = median_of({lengths.data(), lengths.data() + lengths.size()});
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(lengths.size());
  for (Eigen::Index i = 0; i < lengths.size(); ++i) {
    if (lengths[i] > kUsual * middle) weights[i] = kUsual * middle / lengths[i];
    if (lengths[i] > kOutlier * middle && middle > 0) weights[i] = 0;
  }
  return weights;
}

struct Step {
  Eigen::VectorXd d_own;
  Eigen::Vector2d d_timing = Eigen::Vector2d::Zero();
  Eigen::MatrixX2d cleared;  ///< the weighted columns of timing, less what the model's own unknowns can do
  Eigen::VectorXd residual;  ///< weighted, less the same
  Eigen::VectorXd lengths;   ///< of the samples' residuals, as they are
  Eigen::VectorXd weights;   ///< of the samples
};

/// The own unknowns are projected out (Frisch, Waugh, Lovell), so that timing remains a problem of two.
Step step_of(const TimingModel& model, double offset_s, double drift, bool find_drift) {
  const TimingModel::Linearised at = model.linearise(offset_s, drift);
  const Eigen::Index per = model.rows_per_sample(), samples = at.residual.size() / per;
  Step step;
  step.lengths = Eigen::Map<const Eigen::MatrixXd>(at.residual.data(), per, samples).colwise().norm();
  step.weights = weights_of(step.lengths);
  Eigen::VectorXd root(at.residual.size());
  for (Eigen::Index i = 0; i < root.size(); ++i) root[i] = std::sqrt(step.weights[i / per]);
  const Eigen::MatrixXd own = root.asDiagonal() * at.own;
  Eigen::MatrixX2d timing = root.asDiagonal() * at.timing;
  if (!find_drift) timing.col(1).setZero();
  const Eigen::VectorXd residual = root.asDiagonal() * at.residual;
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> projector(own);
  step.cleared = timing - own * projector.solve(timing);
  step.residual = residual - own * projector.solve(residual);
  const Eigen::Matrix2d normal = step.cleared.transpose() * step.cleared;
  const Eigen::Vector2d right = step.cleared.transpose() * step.residual;
  if (find_drift) {
    step.d_timing = normal.ldlt().solve(right);
  } else if (normal(0, 0) > 0) {
    step.d_timing[0] = right[0] / normal(0, 0);
  }
  step.d_own = projector.solve(Eigen::VectorXd(residual - timing * step.d_timing));
  return step;
}

/// Which part each sample belongs to: parts of equal time, numbered without holes.
std::vector<int> parts_of(const std::vector<double>& times_s, int& count) {
  const double begin_s = times_s.front(), span_s = std::max(1e-9, times_s.back() - begin_s);
  const int wanted = std::clamp(static_cast<int>(span_s / kPartS), kFewestParts, kMostParts);
  std::vector<int> part(times_s.size());
  count = 0;
  int last = -1;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const int here = std::min(wanted - 1, static_cast<int>((times_s[i] - begin_s) / span_s * wanted));
    if (here != last) ++count;
    last = here;
    part[i] = count - 1;
  }
  return part;
}

void find_sigmas(const TimingModel& model, const Step& step, bool find_drift, TimingFit& fit) {
  int count = 0;
  const std::vector<int> part = parts_of(model.times_s(), count);
  const Eigen::Index per = model.rows_per_sample();
  const auto parts = static_cast<std::size_t>(count);
  std::vector<Eigen::Matrix2d> normals(parts, Eigen::Matrix2d::Zero());
  std::vector<Eigen::Vector2d> rights(parts, Eigen::Vector2d::Zero());
  std::vector<double> middle(parts, 0), members(parts, 0);
  for (std::size_t i = 0; i < part.size(); ++i) {
    const auto p = static_cast<std::size_t>(part[i]);
    const auto first = static_cast<Eigen::Index>(i) * per;
    const auto columns = step.cleared.middleRows(first, per);
    normals[p] += columns.transpose() * columns;
    rights[p] += columns.transpose() * step.residual.segment(first, per);
    middle[p] += model.times_s()[i];
    members[p] += 1;
  }
  Eigen::Matrix2d all = Eigen::Matrix2d::Zero();
  for (const Eigen::Matrix2d& normal : normals) all += normal;
  if (!find_drift) all(1, 1) = 1;
  Eigen::Matrix2Xd left_out(2, count);
  for (std::size_t p = 0; p < parts; ++p) {
    left_out.col(static_cast<Eigen::Index>(p)) = -(all - normals[p]).ldlt().solve(rights[p]);
    if (!(normals[p](0, 0) > 0)) continue;
    fit.part_s.push_back(middle[p] / members[p]);
    fit.part_offset_s.push_back(rights[p][0] / normals[p](0, 0));
    fit.part_sigma_s.push_back(fit.rms / std::sqrt(normals[p](0, 0)));
  }
  left_out.colwise() -= Eigen::Vector2d(left_out.rowwise().mean());
  const Eigen::Vector2d variance = (count - 1.0) / count * left_out.rowwise().squaredNorm();
  fit.offset_sigma_s = std::sqrt(variance[0]);
  fit.drift_sigma = find_drift ? std::sqrt(variance[1]) : 0;
  fit.student95 = student95(count - 1);
}

}  // namespace

TimingFit fit_timing(TimingModel& model, double offset_s, bool find_drift) {
  TimingFit fit;
  fit.offset_s = offset_s;
  constexpr double kMostStepS = 0.05, kMostDriftStep = 2e-3;
  Step step;
  for (int round = 0; round < kMostRounds; ++round) {
    step = step_of(model, fit.offset_s, fit.drift, find_drift);
    const double d_offset_s = std::clamp(step.d_timing[0], -kMostStepS, kMostStepS);
    fit.offset_s += d_offset_s;
    fit.drift += std::clamp(step.d_timing[1], -kMostDriftStep, kMostDriftStep);
    model.take(step.d_own);
    if (round > 2 && std::abs(d_offset_s) < kDoneS) break;
  }
  step = step_of(model, fit.offset_s, fit.drift, find_drift);
  double sum = 0, kept = 0;
  for (Eigen::Index i = 0; i < step.lengths.size(); ++i) {
    if (step.weights[i] == 0) continue;
    sum += step.lengths[i] * step.lengths[i];
    kept += 1;
  }
  const auto per = static_cast<double>(model.rows_per_sample());
  fit.rms = kept > 0 ? std::sqrt(sum / kept / per) : 0;
  fit.outlier_share = 1 - kept / static_cast<double>(std::max<Eigen::Index>(1, step.lengths.size()));
  for (Eigen::Index i = 0; i < step.lengths.size(); ++i) fit.losses.push_back(step.lengths[i] * step.lengths[i]);
  find_sigmas(model, step, find_drift, fit);
  return fit;
}

double sigmas_worse(const TimingFit& best, const TimingFit& other, const std::vector<double>& times_s) {
  int count = 0;
  const std::vector<int> part = parts_of(times_s, count);
  // Capped at the same length for both, so that a few outliers decide nothing.
  std::vector<double> sorted = best.losses;
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), high, sorted.end());
  const double cap = 4 * *high;
  std::vector<double> worse(static_cast<std::size_t>(count), 0);
  for (std::size_t i = 0; i < part.size(); ++i) {
    worse[static_cast<std::size_t>(part[i])] += std::min(cap, other.losses[i]) - std::min(cap, best.losses[i]);
  }
  const Eigen::Map<const Eigen::ArrayXd> w(worse.data(), count);
  const double mean = w.mean(), variance = (w - mean).square().sum() / (count - 1.0) / count;
  return variance > 0 ? mean / std::sqrt(variance) : 0;
}

}  // namespace birdseye::calibration
