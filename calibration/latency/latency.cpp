#include "calibration/latency/latency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/latency/common_part.hpp"
#include "calibration/latency/latency_limits.hpp"
#include "calibration/latency/latency_models.hpp"
#include "calibration/latency/latency_scan.hpp"
#include "calibration/latency/motion_stream.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kRateWindowS = 0.08;  // half of it: the band of the spline, so that the scan's peak is not blunted
constexpr double kMarginS = 0.08;      // about a sample, so that refining never leaves what a covers

void shift_times(MotionSamples& samples, double by_s) {
  for (MotionSpline::Sample& sample : samples) sample.time_s += by_s;
}
void shift_times(std::vector<ImageMotion>& samples, double by_s) {
  for (ImageMotion& sample : samples) {
    sample.from_s += by_s;
    sample.to_s += by_s;
  }
}
double first_time(const MotionSamples& samples) {
  return samples.front().time_s;
}
double first_time(const std::vector<ImageMotion>& samples) {
  return samples.front().from_s;
}
double last_time(const MotionSamples& samples) {
  return samples.back().time_s;
}
double last_time(const std::vector<ImageMotion>& samples) {
  return samples.back().to_s;
}
bool is_covered(const MotionSpline& a, const MotionSpline::Sample& b, double offset_s) {
  return a.covers(b.time_s - offset_s, kMarginS);
}
bool is_covered(const MotionSpline& a, const ImageMotion& b, double offset_s) {
  return a.covers(b.from_s - offset_s, kMarginS) && a.covers(b.to_s - offset_s, kMarginS);
}

/// Cuts both to what they have in common and what an offset may bring to it, and moves them to a time of which 0 is the
/// middle of it.
template <typename SamplesB>
Result<void> overlap(MotionSamples& a, SamplesB& b, double most_offset_s, Latency& latency) {
  const double begin_s = std::max(first_time(a), first_time(b)), end_s = std::min(last_time(a), last_time(b));
  if (!(end_s > begin_s)) {
    return Error{Errc::bad_value,
                 fmt::format("the streams do not overlap: a lasts from {:.3f} to {:.3f} s, b from {:.3f} to {:.3f} s; "
                             "record both at once, with stamps of one clock",
                             first_time(a), last_time(a), first_time(b), last_time(b))};
  }
  const auto both = common_stretches(stretches_of(a), stretches_of(b));
  latency.overlap_s = seconds_of(both);
  latency.a.recorded_s = last_time(a) - first_time(a);
  latency.b.recorded_s = last_time(b) - first_time(b);
  latency.a.longest_gap_s = longest_gap_s(a, begin_s, end_s);
  latency.b.longest_gap_s = longest_gap_s(b, begin_s, end_s);
  keep_near(both, most_offset_s + kRateWindowS + kMarginS, a);
  keep_near(both, most_offset_s + kRateWindowS + kMarginS, b);
  if (std::min(a.size(), b.size()) < kFewestRows) {
    return Error{Errc::bad_value,
                 fmt::format("the streams have {:.1f} s in common, of at least {:g}, with {} rows of a and {} of b "
                             "there, of at least {}; record both at once, for 20 s without holes",
                             latency.overlap_s, kShortestS, a.size(), b.size(), kFewestRows)};
  }
  latency.at_s = 0.5 * (both.front().first + both.back().second);
  shift_times(a, -latency.at_s);
  shift_times(b, -latency.at_s);
  return {};
}

void take_scan(const LagScan& scan, Latency& latency) {
  latency.correlation = scan.best.correlation;
  latency.lag_s = scan.best.lag_s;
  latency.at_edge = scan.at_edge;
  if (scan.rival) latency.rival_lag_s = scan.rival->lag_s;
  if (scan.rival) latency.rival_correlation = scan.rival->correlation;
  if (scan.far) latency.far_lag_s = scan.far->lag_s;
  if (scan.far) latency.far_correlation = scan.far->correlation;
  latency.curves.lag_s = scan.lags_s;
  latency.curves.correlation = scan.correlation;
}

/// The samples of b that a covers at both lags.
template <typename Sample>
std::vector<Sample> covered(const MotionSpline& a, const std::vector<Sample>& b, double lag_s, double other_lag_s) {
  std::vector<Sample> kept;
  for (const Sample& sample : b) {
    if (is_covered(a, sample, lag_s) && is_covered(a, sample, other_lag_s)) kept.push_back(sample);
  }
  return kept;
}

/// At the best lag, and at the rival's where there is one.
template <typename Sample>
std::vector<Sample> covered(const MotionSpline& a, const std::vector<Sample>& b, const LagScan& scan) {
  return covered(a, b, scan.best.lag_s, scan.rival.value_or(scan.best).lag_s);
}

/// Whether a far peak is high enough to be the truth: that one explains no less than the best within, but for noise.
bool is_far_rival(const LagScan& scan) {
  constexpr double kNoLess = 0.05;
  return scan.far && scan.far->correlation >= scan.best.correlation - kNoLess;
}

void take_fit(const TimingFit& fit, Latency& latency) {
  latency.determined = std::isfinite(fit.offset_sigma_s) && std::isfinite(fit.offset_s);
  latency.offset_ms = 1e3 * fit.offset_s;
  latency.drift_ppm = 1e6 * fit.drift;
  const double half_ms = 1e3 * fit.student95 * fit.offset_sigma_s, half_ppm = 1e6 * fit.student95 * fit.drift_sigma;
  latency.offset_ci95_ms = {latency.offset_ms - half_ms, latency.offset_ms + half_ms};
  latency.drift_ci95_ppm = {latency.drift_ppm - half_ppm, latency.drift_ppm + half_ppm};
  latency.outlier_share = fit.outlier_share;
  for (std::size_t i = 0; i < fit.part_s.size(); ++i) {
    latency.curves.part_s.push_back(fit.part_s[i]);
    latency.curves.part_offset_ms.push_back(1e3 * (fit.offset_s + fit.drift * fit.part_s[i] + fit.part_offset_s[i]));
    latency.curves.part_sigma_ms.push_back(1e3 * fit.part_sigma_s[i]);
  }
}

void take_speeds(const RateGrid& a, const RateSignal& b, LatencyCurves& curves) {
  for (Eigen::Index i = 0; i < a.rates.rows(); ++i) {
    if (!a.valid[static_cast<std::size_t>(i)]) continue;
    curves.a_s.push_back(a.begin_s + static_cast<double>(i) * a.spacing_s);
    curves.a_speed.push_back(a.rates.row(i).norm());
  }
  curves.b_s = b.times_s;
  for (Eigen::Index i = 0; i < b.rates.rows(); ++i) curves.b_speed.push_back(b.rates.row(i).norm());
}

/// Moving enough, and long enough, for a fit to be worth the while.
bool is_worth_a_fit(const Latency& latency) {
  return is_moving(latency.a) && is_moving(latency.b) && latency.overlap_s >= kShortestS &&
         latency.correlation >= kLeastCorrelation;
}

constexpr std::size_t kFewestFitted = 40;

/// By how many standard errors the samples are explained worse at the peak than at the best lag.
template <typename Sample, typename TimingAt>
double sigmas_worse_at(const LagPeak& peak, const LagPeak& best, const std::vector<Sample>& samples,
                       const LatencySettings& settings, const TimingAt& timing_at) {
  auto near = timing_at(samples, best), other = timing_at(samples, peak);
  const TimingFit of_near = fit_timing(near, best.lag_s, settings.find_drift);
  return sigmas_worse(of_near, fit_timing(other, peak.lag_s, settings.find_drift), near.times_s());
}

/// Of the far peak, over samples of its own, so that it takes none from the fit. Empty where it is no rival, or too few
/// samples are covered at both lags to tell what it is worth.
template <typename Sample, typename TimingAt>
std::optional<double> far_sigmas_of(const MotionSpline& spline, const std::vector<Sample>& of_b, const LagScan& scan,
                                    const LatencySettings& settings, const TimingAt& timing_at) {
  if (!is_far_rival(scan)) return std::nullopt;
  const auto both = covered(spline, of_b, scan.best.lag_s, scan.far->lag_s);
  if (both.size() < kFewestFitted) return std::nullopt;
  return sigmas_worse_at(*scan.far, scan.best, both, settings, timing_at);
}

bool too_few(const std::size_t samples, Latency& latency) {
  latency.determined = false;
  return samples < kFewestFitted;
}

}  // namespace

Result<Latency> find_latency(std::span<const TimedRotation> a, std::span<const TimedRotation> b,
                             const LatencySettings& settings) {
  Latency latency;
  const auto as_poses = [](std::span<const TimedRotation> rows) {
    std::vector<TimedMotionPose> poses;
    for (const TimedRotation& row : rows) poses.push_back({row.time_s, row.base_from_body, Eigen::Vector3d::Zero()});
    return poses;
  };
  auto of_a = clean(std::span<const TimedMotionPose>(as_poses(a)), "a", latency.a);
  if (!of_a) return std::move(of_a).error();
  auto of_b = clean(std::span<const TimedMotionPose>(as_poses(b)), "b", latency.b);
  if (!of_b) return std::move(of_b).error();
  if (auto common = overlap(*of_a, *of_b, settings.most_offset_s, latency); !common) return common.error();
  measure(*of_a, latency.a);
  measure(*of_b, latency.b);

  const MotionSpline spline(*of_a);
  const RateGrid grid = rate_grid(spline, first_time(*of_a), last_time(*of_a), false);
  const RateSignal rates = turn_rates(*of_b, std::max(kRateWindowS, 1.2 / latency.b.rate_hz));
  const LagScan scan = scan_lags(grid, rates, RateMap::rotation, settings.most_offset_s, settings.farthest_s);
  latency.sought_s = settings.most_offset_s;
  take_scan(scan, latency);
  take_speeds(grid, rates, latency.curves);
  const MotionSamples used = covered(spline, *of_b, scan);
  if (too_few(used.size(), latency) || !is_worth_a_fit(latency)) return latency;

  const auto timing_at = [&spline](const MotionSamples& samples, const LagPeak& peak) {
    return RotationTiming(spline, samples, peak.turn, peak.lag_s);
  };
  RotationTiming model = timing_at(used, scan.best);
  const TimingFit fit = fit_timing(model, scan.best.lag_s, settings.find_drift);
  take_fit(fit, latency);
  latency.residual = kDegPerRad * fit.rms;
  latency.b_from_a = model.b_from_a();
  if (scan.rival) latency.rival_sigmas = sigmas_worse_at(*scan.rival, scan.best, used, settings, timing_at);
  latency.far_sigmas = far_sigmas_of(spline, *of_b, scan, settings, timing_at);
  return latency;
}

Result<Latency> find_latency(std::span<const TimedMotionPose> a, std::span<const ImageMotion> b,
                             const LatencySettings& settings) {
  Latency latency;
  auto of_a = clean(a, "a", latency.a);
  if (!of_a) return std::move(of_a).error();
  auto of_b = clean(b, "b", latency.b);
  if (!of_b) return std::move(of_b).error();
  if (auto common = overlap(*of_a, *of_b, settings.most_offset_s, latency); !common) return common.error();
  measure(*of_a, latency.a);
  measure(*of_b, latency.b);

  const MotionSpline spline(*of_a);
  const RateGrid grid = rate_grid(spline, first_time(*of_a), last_time(*of_a), true);
  const RateSignal rates = image_rates(*of_b);
  const LagScan scan = scan_lags(grid, rates, RateMap::linear, settings.most_offset_s, settings.farthest_s);
  latency.sought_s = settings.most_offset_s;
  take_scan(scan, latency);
  take_speeds(grid, rates, latency.curves);
  const std::vector<ImageMotion> used = covered(spline, *of_b, scan);
  if (too_few(used.size(), latency) || !is_worth_a_fit(latency)) return latency;

  const auto timing_at = [&spline](const std::vector<ImageMotion>& samples, const LagPeak& peak) {
    return ImageTiming(spline, samples, peak.lag_s);
  };
  ImageTiming model = timing_at(used, scan.best);
  const TimingFit fit = fit_timing(model, scan.best.lag_s, settings.find_drift);
  take_fit(fit, latency);
  latency.residual = fit.rms;
  latency.curves.a_s.clear();
  for (const double t : model.times_s()) latency.curves.a_s.push_back(t - fit.offset_s - fit.drift * t);
  latency.curves.a_speed = model.modelled_speeds(fit.offset_s, fit.drift);
  if (scan.rival) latency.rival_sigmas = sigmas_worse_at(*scan.rival, scan.best, used, settings, timing_at);
  latency.far_sigmas = far_sigmas_of(spline, *of_b, scan, settings, timing_at);
  return latency;
}

}  // namespace birdseye::calibration
