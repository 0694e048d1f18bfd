#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/latency/latency.hpp"
#include "calibration/latency/latency_limits.hpp"

namespace birdseye::calibration {

namespace {

constexpr const char* kHowToMove =
    "turn the scope to and fro about two axes, by 20 degrees, about once a second but not evenly, for 20 s";

constexpr const char* kNotEvenly = "do not swing evenly: change pace, width and direction while you record";

void judge_motion(const StreamMotion& motion, const std::string& name, Verdict& verdict) {
  for (const std::string& odd : motion.odd) verdict.add(Grade::marginal, odd);
  if (is_moving(motion)) return;
  std::string how_much = fmt::format("{:.1f} deg/s", motion.turn_speed_deg_s);
  std::string limit = fmt::format("{:g} deg/s", kLeastTurnDegS);
  if (motion.shift_speed_mm_s > 0) {
    how_much += fmt::format(" and {:.1f} mm/s", motion.shift_speed_mm_s);
    limit += fmt::format(" or {:g} mm/s", kLeastShiftMmS);
  }
  if (motion.image_speed_px_s > 0) {
    how_much = fmt::format("{:.1f} px/s", motion.image_speed_px_s);
    limit = fmt::format("{:g} px/s", kLeastImagePxS);
  }
  verdict.add(Grade::fail, fmt::format("the {} hardly moves: {}, of at least {}", name, how_much, limit), kHowToMove);
}

void judge_gap(const StreamMotion& motion, const std::string& name, Verdict& verdict) {
  if (motion.longest_gap_s <= kLongGapS) return;
  verdict.add(Grade::marginal,
              fmt::format("the {} has a hole of {:.1f} s, which is passed over", name, motion.longest_gap_s),
              fmt::format("see why the {} falls silent (Health tells), and record again", name));
}

/// What was left out, so that nobody takes the figures for those of the whole recording.
void tell_part(const Latency& latency, const std::string& a_name, const std::string& b_name, Verdict& verdict) {
  constexpr double kToldS = 3;
  if (std::max(latency.a.recorded_s, latency.b.recorded_s) - latency.overlap_s < kToldS) return;
  verdict.add(Grade::pass, fmt::format("only the {:.1f} s that both have were used, of {:.1f} s of the {} and {:.1f} s "
                                       "of the {}",
                                       latency.overlap_s, latency.a.recorded_s, a_name, latency.b.recorded_s, b_name));
}

/// Whether a lag beyond what was sought explains the streams better than the best within.
bool is_beyond(const Latency& latency) {
  if (latency.far_correlation < kGoodCorrelation) return false;
  if (latency.far_sigmas) return *latency.far_sigmas <= -kRivalSigmas;
  const bool no_answer = latency.at_edge || latency.correlation < kLeastCorrelation;
  return no_answer && latency.far_correlation > latency.correlation + kAlikeCorrelation;
}

/// Whether one may explain them as well.
bool has_far_rival(const Latency& latency) {
  return latency.far_correlation > 0 && latency.far_correlation >= latency.correlation - kAlikeCorrelation &&
         latency.far_sigmas.value_or(0) < kRivalSigmas;
}

void judge_far_rival(const Latency& latency, Verdict& verdict) {
  const std::string lags = fmt::format("{:.0f} ms, beyond the {:.0f} ms either way that are sought, ",
                                       1e3 * latency.far_lag_s, 1e3 * latency.sought_s);
  const std::string than = fmt::format("{:.0f} ms (correlation {:.2f} and {:.2f})", 1e3 * latency.lag_s,
                                       latency.far_correlation, latency.correlation);
  if (latency.far_sigmas) {
    verdict.add(Grade::fail, fmt::format("the motion repeats itself: {}explains it nearly as well as {}", lags, than),
                kNotEvenly);
    return;
  }
  verdict.add(latency.far_correlation > latency.correlation ? Grade::fail : Grade::marginal,
              fmt::format("whether {}explains the motion as well as {} cannot be told: too few samples are covered at "
                          "both",
                          lags, than),
              "record for longer");
}

/// What makes an offset no answer. True if there is such a thing.
bool judge_peak(const Latency& latency, Verdict& verdict) {
  if (latency.overlap_s < kShortestS) {
    verdict.add(Grade::fail,
                fmt::format("the streams have {:.1f} s in common, of at least {:g}", latency.overlap_s, kShortestS),
                "record for 20 s");
  }
  if (verdict.grade == Grade::fail) return true;
  if (is_beyond(latency)) {
    verdict.add(Grade::fail,
                fmt::format("the motions agree best at a lag of {:.0f} ms (correlation {:.2f}), beyond the {:.0f} ms "
                            "either way that are sought; of these {:.0f} ms is best (correlation {:.2f})",
                            1e3 * latency.far_lag_s, latency.far_correlation, 1e3 * latency.sought_s,
                            1e3 * latency.lag_s, latency.correlation),
                "see that both streams are stamped by one clock: one that is late by so much is stamped by another, or "
                "waits somewhere");
  } else if (latency.correlation < kLeastCorrelation) {
    verdict.add(Grade::fail,
                fmt::format("the two motions do not agree at any lag: correlation {:.2f}, of at least {:g}",
                            latency.correlation, kLeastCorrelation),
                "let only the scope move, not what it looks at, and see that the bird is fixed to the scope");
  } else if (latency.at_edge) {
    verdict.add(Grade::fail, fmt::format("the best lag, {:.0f} ms, is the end of what was tried", 1e3 * latency.lag_s),
                "see that both streams are stamped by one clock");
  } else if (!latency.determined) {
    verdict.add(Grade::fail, "too few samples of the two meet", "record for 20 s without holes");
  } else if (latency.rival_correlation > 0 && latency.rival_sigmas < kRivalSigmas) {
    verdict.add(
        Grade::fail,
        fmt::format("the motion repeats itself: {:.0f} ms explains it nearly as well as {:.0f} ms (correlation "
                    "{:.2f} and {:.2f})",
                    1e3 * latency.rival_lag_s, 1e3 * latency.lag_s, latency.rival_correlation, latency.correlation),
        kNotEvenly);
  } else if (has_far_rival(latency)) {
    judge_far_rival(latency, verdict);
  }
  return verdict.grade == Grade::fail;
}

}  // namespace

Verdict latency_verdict(const Latency& latency, const std::string& a_name, const std::string& b_name) {
  Verdict verdict;
  tell_part(latency, a_name, b_name, verdict);
  judge_motion(latency.a, a_name, verdict);
  judge_motion(latency.b, b_name, verdict);
  if (judge_peak(latency, verdict)) return verdict;
  const double half_ms = 0.5 * (latency.offset_ci95_ms[1] - latency.offset_ci95_ms[0]);
  verdict.judge("half of the interval of the offset", half_ms, "ms", kGoodHalfMs, kMostHalfMs,
                "record for longer, and turn faster");
  if (latency.correlation < kGoodCorrelation) {
    verdict.add(Grade::marginal,
                fmt::format("the two motions agree only in part: correlation {:.2f}, of at least {:g}",
                            latency.correlation, kGoodCorrelation),
                "let only the scope move, not what it looks at");
  }
  if (latency.overlap_s < kGoodS) {
    verdict.add(Grade::marginal,
                fmt::format("the streams have {:.1f} s in common, of at least {:g}", latency.overlap_s, kGoodS),
                "record for 20 s");
  }
  if (latency.outlier_share > kMostOutliers) {
    verdict.add(latency.outlier_share > kTooManyOutliers ? Grade::fail : Grade::marginal,
                fmt::format("{:.0f} % of the {}'s samples do not fit, of at most {:.0f} %", 100 * latency.outlier_share,
                            b_name, 100 * kMostOutliers),
                "see that nothing else moves in the picture, and no metal near the tracker");
  }
  if (latency.drift_ci95_ppm[0] > kMostDriftPpm || latency.drift_ci95_ppm[1] < -kMostDriftPpm) {
    verdict.add(Grade::marginal,
                fmt::format("the clocks run apart by {:.0f} ppm, of at most {:g}: {:.0f} ms in ten minutes",
                            latency.drift_ppm, kMostDriftPpm, std::abs(latency.drift_ppm) * 0.6),
                "set the tracker's and the camera's rate_hz to their true rates");
  }
  judge_gap(latency.a, a_name, verdict);
  judge_gap(latency.b, b_name, verdict);
  return verdict;
}

}  // namespace birdseye::calibration
