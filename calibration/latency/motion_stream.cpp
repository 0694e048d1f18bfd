#include "calibration/latency/motion_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/latency/latency_limits.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kMostOutOfOrder = 0.01;  // of the rows: a late packet or two, not another clock
constexpr double kJumpBackS = 1;
constexpr double kSpeedWindowS = 0.15;  // half of it

bool is_finite(const TimedMotionPose& row) {
  return std::isfinite(row.time_s) && row.base_from_body.coeffs().allFinite() && row.origin_in_base_mm.allFinite() &&
         row.base_from_body.norm() > 0.5;
}
bool is_finite(const ImageMotion& row) {
  return std::isfinite(row.from_s) && std::isfinite(row.to_s) && row.motion_px.allFinite() && row.to_s > row.from_s;
}
double time_of(const TimedMotionPose& row) {
  return row.time_s;
}
double time_of(const ImageMotion& row) {
  return row.to_s;
}

template <typename Row>
Result<std::vector<Row>> put_in_order(std::span<const Row> rows, const std::string& name, StreamMotion& motion) {
  std::vector<Row> kept;
  std::size_t senseless = 0, backwards = 0, twice = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!is_finite(rows[i])) {
      ++senseless;
      continue;
    }
    if (!kept.empty() && time_of(rows[i]) < time_of(kept.back())) {
      ++backwards;
      if (time_of(rows[i]) < time_of(kept.back()) - kJumpBackS) {
        return Error{Errc::bad_value,
                     fmt::format("stream {}: its time jumps back by {:.3f} s at row {}; record again, or "
                                 "cut it there",
                                 name, time_of(kept.back()) - time_of(rows[i]), i + 1)};
      }
    }
    kept.push_back(rows[i]);
  }
  if (static_cast<double>(backwards) > kMostOutOfOrder * static_cast<double>(kept.size())) {
    return Error{Errc::bad_value,
                 fmt::format("stream {}: {} of {} rows are earlier than the row before; sort it by time, "
                             "if its times are those of the measurements",
                             name, backwards, kept.size())};
  }
  std::stable_sort(kept.begin(), kept.end(), [](const Row& p, const Row& q) { return time_of(p) < time_of(q); });
  const auto same =
      std::unique(kept.begin(), kept.end(), [](const Row& p, const Row& q) { return time_of(p) == time_of(q); });
  twice = static_cast<std::size_t>(kept.end() - same);
  kept.erase(same, kept.end());
  if (senseless > 0)
    motion.odd.push_back(fmt::format("{} rows of {} are no motion or not finite: left out", senseless, name));
  if (backwards > 0) motion.odd.push_back(fmt::format("{} rows of {} were out of order: sorted", backwards, name));
  if (twice > 0) motion.odd.push_back(fmt::format("{} rows of {} bear the time of another: left out", twice, name));
  if (kept.size() < kFewestRows) {
    return Error{Errc::bad_value,
                 fmt::format("stream {}: {} usable rows, of at least {} that are needed; record for 20 s", name,
                             kept.size(), kFewestRows)};
  }
  return kept;
}

void measure_times(std::vector<double> times_s, StreamMotion& motion) {
  motion.samples = times_s.size();
  motion.seconds = times_s.back() - times_s.front();
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times_s.size(); ++i) intervals.push_back(times_s[i] - times_s[i - 1]);
  motion.rate_hz = 1 / median_of(std::move(intervals));
}

/// Slopes of lines through columns of values within the window: of turns from the middle sample, or of places.
template <typename ValueOf>
RateSignal slopes(const MotionSamples& samples, double half_window_s, const ValueOf& value_of) {
  RateSignal signal;
  std::vector<Eigen::Vector3d> rates;
  std::size_t first = 0, end = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = samples[i].time_s;
    while (samples[first].time_s < t - half_window_s) ++first;
    while (end < samples.size() && samples[end].time_s <= t + half_window_s) ++end;
    if (first == i || end == i + 1) continue;
    double sum_t = 0, sum_tt = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), sum_t_value = Eigen::Vector3d::Zero();
    for (std::size_t k = first; k < end; ++k) {
      const double s = samples[k].time_s - t;
      const Eigen::Vector3d value = value_of(samples[i], samples[k]);
      sum_t += s;
      sum_tt += s * s;
      sum += value;
      sum_t_value += s * value;
    }
    const auto n = static_cast<double>(end - first);
    const double spread = sum_tt - sum_t * sum_t / n;
    if (!(spread > 0)) continue;
    signal.times_s.push_back(t + sum_t / n);
    rates.emplace_back((sum_t_value - sum_t / n * sum) / spread);
  }
  signal.rates.resize(static_cast<Eigen::Index>(rates.size()), 3);
  for (std::size_t i = 0; i < rates.size(); ++i) signal.rates.row(static_cast<Eigen::Index>(i)) = rates[i];
  return signal;
}

Eigen::Vector3d turn_between(const MotionSpline::Sample& from, const MotionSpline::Sample& to) {
  return rotation_log((from.base_from_body.conjugate() * to.base_from_body).normalized().toRotationMatrix());
}

/// Root mean square about the mean, without the twentieth of rows that are fastest: a jump is no motion.
double usual_speed(const Eigen::MatrixXd& rates) {
  if (rates.rows() == 0) return 0;
  const Eigen::MatrixXd centred = rates.rowwise() - Eigen::RowVectorXd(rates.colwise().mean());
  const Eigen::VectorXd squares = centred.rowwise().squaredNorm();
  std::vector<double> sorted(squares.data(), squares.data() + squares.size());
  std::sort(sorted.begin(), sorted.end());
  sorted.resize(std::max<std::size_t>(1, sorted.size() * 19 / 20));
  double sum = 0;
  for (const double square : sorted) sum += square;
  return std::sqrt(sum / static_cast<double>(sorted.size()));
}

}  // namespace

Result<MotionSamples> clean(std::span<const TimedMotionPose> rows, const std::string& name, StreamMotion& motion) {
  auto kept = put_in_order(rows, name, motion);
  if (!kept) return std::move(kept).error();
  MotionSamples samples;
  for (const TimedMotionPose& row : *kept)
    samples.push_back({row.time_s, row.base_from_body.normalized(), row.origin_in_base_mm});
  return samples;
}

Result<std::vector<ImageMotion>> clean(std::span<const ImageMotion> rows, const std::string& name,
                                       StreamMotion& motion) {
  return put_in_order(rows, name, motion);
}

void measure(const MotionSamples& samples, StreamMotion& motion) {
  std::vector<double> times_s;
  for (const auto& sample : samples) times_s.push_back(sample.time_s);
  measure_times(std::move(times_s), motion);
  const double half_s = std::max(kSpeedWindowS, 2.2 / motion.rate_hz);
  motion.turn_speed_deg_s = kDegPerRad * usual_speed(slopes(samples, half_s, turn_between).rates);
  motion.shift_speed_mm_s = usual_speed(slopes(samples, half_s, [](const auto& from, const auto& to) {
                                          return Eigen::Vector3d(to.origin_in_base - from.origin_in_base);
                                        }).rates);
}

void measure(const std::vector<ImageMotion>& samples, StreamMotion& motion) {
  std::vector<double> times_s;
  times_s.reserve(samples.size());
  for (const ImageMotion& sample : samples) times_s.push_back(sample.to_s);
  measure_times(std::move(times_s), motion);
  motion.image_speed_px_s = usual_speed(image_rates(samples).rates);
}

RateSignal turn_rates(const MotionSamples& samples, double half_window_s) {
  return slopes(samples, half_window_s, turn_between);
}

RateSignal image_rates(const std::vector<ImageMotion>& samples) {
  RateSignal signal;
  signal.rates.resize(static_cast<Eigen::Index>(samples.size()), 4);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    signal.times_s.push_back(0.5 * (samples[i].from_s + samples[i].to_s));
    signal.rates.row(static_cast<Eigen::Index>(i)) = samples[i].motion_px / (samples[i].to_s - samples[i].from_s);
  }
  return signal;
}

RateGrid rate_grid(const MotionSpline& spline, double begin_s, double end_s, bool with_shifts) {
  RateGrid grid;
  grid.begin_s = begin_s;
  const auto rows = static_cast<Eigen::Index>(std::max(0.0, (end_s - begin_s) / grid.spacing_s)) + 1;
  grid.rates.resize(rows, with_shifts ? 6 : 3);
  constexpr double kStepS = 0.02;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = begin_s + static_cast<double>(i) * grid.spacing_s;
    grid.valid.push_back(spline.covers(t, kStepS));
    if (with_shifts) {
      grid.rates.row(i) = spline.step(t - 0.5 * kStepS, t + 0.5 * kStepS) / kStepS;
    } else {
      grid.rates.row(i) = spline.turn_rate_at(t);
    }
  }
  return grid;
}

}  // namespace birdseye::calibration
