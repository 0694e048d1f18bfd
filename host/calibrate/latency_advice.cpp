#include "host/calibrate/latency_advice.hpp"

#include <fmt/format.h>

#include <cmath>

#include "calibration/latency/latency_limits.hpp"

namespace birdseye::host {

namespace {

using calibration::Latency;

/// How late frames are once `taken_ms` were taken off their times.
struct Left {
  double ms = 0, low_ms = 0, high_ms = 0;
  Left(const Latency& latency, double taken_ms)
      : ms(latency.offset_ms - taken_ms),
        low_ms(latency.offset_ci95_ms[0] - taken_ms),
        high_ms(latency.offset_ci95_ms[1] - taken_ms) {}
  [[nodiscard]] bool is_none() const { return low_ms < 0 && high_ms > 0; }
  [[nodiscard]] std::string words() const {
    return fmt::format("{:.1f} ms too {} against the tracker's", std::abs(ms), ms > 0 ? "late" : "early");
  }
};

constexpr const char* kAgainIntoRecord =
    "run this again with --record and the record that birdseyed uses, or set delay_ms back to what it was when that "
    "record's latency was measured";

std::string advice_in_force(const Latency& latency, const LatencySetting& setting) {
  const Left left(latency, *setting.in_force_ms);
  const std::string taken =
      fmt::format("birdseyed takes {:.1f} ms off the frames' times by its calibration record; ", *setting.in_force_ms);
  if (left.is_none())
    return fmt::format(
        "{}so they agree with the tracker's: {:.1f} ms is within the interval of 0; leave delay_ms as "
        "it is",
        taken, left.ms);
  if (setting.into_record)
    return fmt::format("{}so they are {}, until it uses the record that is written now: leave delay_ms as it is", taken,
                       left.words());
  return fmt::format("{}so they are {}: {}", taken, left.words(), kAgainIntoRecord);
}

LatencyAdvice advice_on_delay(const Latency& latency, const std::optional<double>& delay_ms) {
  const double late_ms = latency.offset_ms;
  const bool late = late_ms > 0;
  const std::string found = fmt::format("the frames' times are {}: ", Left(latency, 0).words());
  // Poses cannot be put below no delay at all, and nobody said how far [tracker] delay_ms is above that.
  const std::string of_stamps = fmt::format(
      "where the camera stamps its frames itself, {}enter it into the scope's record (--record) and leave delay_ms "
      "alone",
      late ? "" : fmt::format("raise [tracker] delay_ms by {:.1f}, or ", -late_ms));
  if (delay_ms && *delay_ms + late_ms < 0) {
    return {
        fmt::format("{}[camera] delay_ms cannot be lowered by as much: raise [tracker] delay_ms by {:.1f}, or enter "
                    "it into the scope's record (--record)",
                    found, -late_ms),
        std::nullopt};
  }
  if (delay_ms)
    return {fmt::format("{}set [camera] delay_ms to {:.1f}; or, {}", found, *delay_ms + late_ms, of_stamps),
            *delay_ms + late_ms};
  return {fmt::format("{}{} [camera] delay_ms by {:.1f}; or, {}", found, late ? "raise" : "lower", std::abs(late_ms),
                      of_stamps),
          std::nullopt};
}

}  // namespace

LatencyAdvice advise_latency(const Latency& latency, const LatencySetting& setting) {
  if (setting.in_force_ms) return {advice_in_force(latency, setting), std::nullopt};
  const Left left(latency, 0);
  if (left.is_none()) {
    return {fmt::format("the frames' times agree with the tracker's: {:.1f} ms is within the interval of 0; leave "
                        "delay_ms as it is",
                        left.ms),
            setting.into_record ? std::nullopt : setting.delay_ms};
  }
  if (!setting.into_record) return advice_on_delay(latency, setting.delay_ms);
  return {
      fmt::format("the frames' times are {}: birdseyed takes that off by itself once its [calibration] record is the "
                  "one that is written now; leave delay_ms as it is{}, else it is taken off twice",
                  left.words(), setting.delay_ms ? fmt::format(", {:g}", *setting.delay_ms) : ""),
      std::nullopt};
}

void judge_in_force(const Latency& latency, const LatencySetting& setting, Verdict& verdict) {
  if (!setting.in_force_ms) return;
  const Left left(latency, *setting.in_force_ms);
  const std::string reason =
      fmt::format("{:.1f} ms is taken off the frames' times by the calibration record in force", *setting.in_force_ms);
  if (left.low_ms <= calibration::kGoodHalfMs && left.high_ms >= -calibration::kGoodHalfMs)
    return verdict.add(Grade::pass, reason);
  const std::string wrong = fmt::format(
      "{}, and with it they are {}, as where delay_ms was changed since that was measured", reason, left.words());
  if (setting.into_record) return verdict.add(Grade::pass, wrong);
  verdict.add(Grade::marginal, wrong, kAgainIntoRecord);
}

}  // namespace birdseye::host
