#include "calibration/latency/latency_scan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/latency/latency_limits.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kLagStepS = 0.01;
constexpr int kFarStep = 3;               // in kLagStepS: a hand's motion is alike over twice as long
constexpr Eigen::Index kMostRows = 6000;  // of b: more make no peak clearer
constexpr double kLeastShare = 0.5;       // of the rows that meet at the lag where most do, for another lag to count
constexpr Eigen::Index kFewestMeeting = 10;

/// Rows longer than one and a half times what 95 % of rows stay under are cut to that: a jump of a tracker is not to
/// outweigh the recording.
void clip(Eigen::MatrixXd& rates) {
  if (rates.rows() == 0) return;
  const Eigen::VectorXd norms = rates.rowwise().norm();
  std::vector<double> sorted(norms.data(), norms.data() + norms.size());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  const double limit = 1.5 * *at;
  for (Eigen::Index i = 0; i < rates.rows(); ++i) {
    if (norms[i] > limit && norms[i] > 0) rates.row(i) *= limit / norms[i];
  }
}

std::optional<Eigen::VectorXd> look_up(const RateGrid& grid, double time_s) {
  const double at = (time_s - grid.begin_s) / grid.spacing_s;
  if (!(at >= 0) || at >= static_cast<double>(grid.rates.rows() - 1)) return std::nullopt;
  const auto low = static_cast<std::size_t>(at);
  if (!grid.valid[low] || !grid.valid[low + 1]) return std::nullopt;
  const double part = at - static_cast<double>(low);
  const auto row = static_cast<Eigen::Index>(low);
  return Eigen::VectorXd((1 - part) * grid.rates.row(row) + part * grid.rates.row(row + 1));
}

/// The rows of both streams that meet at one lag, means removed.
struct Meeting {
  Eigen::MatrixXd a, b;
};

std::optional<Meeting> meet(const RateGrid& a, const RateSignal& b, double lag_s) {
  const Eigen::Index every = std::max<Eigen::Index>(1, b.rates.rows() / kMostRows);
  std::vector<Eigen::VectorXd> of_a;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < b.rates.rows(); i += every) {
    if (auto found = look_up(a, b.times_s[static_cast<std::size_t>(i)] - lag_s)) {
      of_a.push_back(*std::move(found));
      rows.push_back(i);
    }
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count < kFewestMeeting) return std::nullopt;
  Meeting meeting{Eigen::MatrixXd(count, a.rates.cols()), Eigen::MatrixXd(count, b.rates.cols())};
  for (Eigen::Index i = 0; i < count; ++i) {
    meeting.a.row(i) = of_a[static_cast<std::size_t>(i)];
    meeting.b.row(i) = b.rates.row(rows[static_cast<std::size_t>(i)]);
  }
  meeting.a.rowwise() -= Eigen::RowVectorXd(meeting.a.colwise().mean());
  meeting.b.rowwise() -= Eigen::RowVectorXd(meeting.b.colwise().mean());
  return meeting;
}

/// Kabsch: the rotation that brings a's rates nearest to b's, and how much of them it explains.
double rotation_correlation(const Meeting& meeting, Eigen::Matrix3d* turn) {
  const Eigen::Matrix3d cross = meeting.b.transpose() * meeting.a;
  double likeness = 0;
  const Eigen::Matrix3d nearest = nearest_rotation(cross, &likeness);
  if (turn != nullptr) *turn = nearest;
  const double size = meeting.a.norm() * meeting.b.norm();
  return size > 0 ? std::max(0.0, likeness / size) : 0;
}

double linear_correlation(const Meeting& meeting) {
  Eigen::MatrixXd a = meeting.a;
  for (Eigen::Index k = 0; k < a.cols(); ++k) {
    const double size = a.col(k).norm();
    if (size > 0) a.col(k) /= size;
  }
  constexpr double kRidge = 1e-6;  // a body that turns about one axis only leaves others open
  const Eigen::MatrixXd normal = a.transpose() * a + kRidge * Eigen::MatrixXd::Identity(a.cols(), a.cols());
  const Eigen::MatrixXd left = meeting.b - a * solve_symmetric(normal, Eigen::MatrixXd(a.transpose() * meeting.b));
  const double all = meeting.b.squaredNorm();
  if (!(all > 0)) return 0;
  // What so many free numbers explain of anything is taken off, as the adjusted coefficient of determination does.
  const auto rows = static_cast<double>(a.rows());
  const double share =
      1 - left.squaredNorm() / all * (rows - 1) / std::max(1.0, rows - 1 - static_cast<double>(a.cols()));
  return std::sqrt(std::clamp(share, 0.0, 1.0));
}

bool is_peak(const std::vector<double>& c, std::size_t i) {
  return (i == 0 || c[i] >= c[i - 1]) && (i + 1 == c.size() || c[i] > c[i + 1]);
}

void find_rival(LagScan& scan, std::size_t best) {
  const std::vector<double>& c = scan.correlation;
  for (std::size_t i = 0; i < c.size(); ++i) {
    if (i == best || !is_peak(c, i) || (scan.rival && c[i] <= scan.rival->correlation)) continue;
    const auto from = c.begin() + static_cast<std::ptrdiff_t>(std::min(i, best));
    const auto to = c.begin() + static_cast<std::ptrdiff_t>(std::max(i, best));
    if (*std::min_element(from, to) > c[i] - kAlikeCorrelation) continue;
    scan.rival = LagPeak{scan.lags_s[i], c[i]};
  }
}

struct Scanned {
  double lag_s = 0, correlation = 0, met = 0;
};

/// The best peak of those outside of the range. `all` are in order of lag, the range's own among them.
void find_far(LagScan& scan, const std::vector<Scanned>& all, double most_lag_s,
              const std::function<Scanned(int)>& at) {
  std::vector<double> c;
  std::size_t best = 0;
  for (const Scanned& one : all) {
    if (one.lag_s <= scan.best.lag_s) best = c.size();
    c.push_back(one.correlation);
  }
  for (std::size_t i = 0; i < c.size(); ++i) {
    if (std::abs(all[i].lag_s) <= most_lag_s || !is_peak(c, i)) continue;
    const auto from = c.begin() + static_cast<std::ptrdiff_t>(std::min(i, best));
    const auto to = c.begin() + static_cast<std::ptrdiff_t>(std::max(i, best));
    if (*std::min_element(from, to) > c[i] - kAlikeCorrelation && c[i] <= scan.best.correlation) continue;
    // Between two of the wide steps it may be higher.
    const int middle = static_cast<int>(std::lround(all[i].lag_s / kLagStepS));
    for (int n = middle - kFarStep + 1; n < middle + kFarStep; ++n) {
      const Scanned near = at(n);
      if (std::abs(near.lag_s) <= most_lag_s || near.correlation <= (scan.far ? scan.far->correlation : 0)) continue;
      scan.far = LagPeak{near.lag_s, near.correlation};
    }
  }
}

}  // namespace

LagScan scan_lags(const RateGrid& a, const RateSignal& b, RateMap map, double most_lag_s, double farthest_s) {
  RateGrid clipped_a = a;
  RateSignal clipped_b = b;
  clip(clipped_a.rates);
  clip(clipped_b.rates);
  const auto at = [&](int n) {
    const double lag_s = n * kLagStepS;
    const auto meeting = meet(clipped_a, clipped_b, lag_s);
    const double c = !meeting                   ? 0
                     : map == RateMap::rotation ? rotation_correlation(*meeting, nullptr)
                                                : linear_correlation(*meeting);
    return Scanned{lag_s, c, meeting ? static_cast<double>(meeting->a.rows()) : 0};
  };
  LagScan scan;
  std::vector<Scanned> sought;
  const int steps = static_cast<int>(std::lround(most_lag_s / kLagStepS));
  for (int n = -steps; n <= steps; ++n) sought.push_back(at(n));
  double most_met = 0;
  for (const Scanned& one : sought) most_met = std::max(most_met, one.met);
  const auto counted = [&](Scanned one) {
    if (one.met < kLeastShare * most_met) one.correlation = 0;
    return one;
  };
  for (Scanned& one : sought) {
    one = counted(one);
    scan.lags_s.push_back(one.lag_s);
    scan.correlation.push_back(one.correlation);
  }
  const auto top = std::max_element(scan.correlation.begin(), scan.correlation.end());
  const auto best = static_cast<std::size_t>(top - scan.correlation.begin());
  scan.best = {scan.lags_s[best], *top};
  scan.at_edge = best == 0 || best + 1 == scan.lags_s.size();
  find_rival(scan, best);
  const auto counted_at = [&](int n) { return counted(at(n)); };
  std::vector<Scanned> all = sought;
  const int farthest = static_cast<int>(std::lround(farthest_s / kLagStepS));
  for (int n = steps + kFarStep; n <= farthest; n += kFarStep) {
    all.insert(all.begin(), counted_at(-n));
    all.push_back(counted_at(n));
  }
  find_far(scan, all, most_lag_s, counted_at);
  if (map == RateMap::rotation) {
    for (LagPeak* const peak : {&scan.best, scan.rival ? &*scan.rival : nullptr, scan.far ? &*scan.far : nullptr}) {
      if (peak == nullptr) continue;
      if (const auto meeting = meet(clipped_a, clipped_b, peak->lag_s)) rotation_correlation(*meeting, &peak->turn);
    }
  }
  return scan;
}

}  // namespace birdseye::calibration
