#pragma once

#include <optional>
#include <string>

#include "calibration/base/verdict.hpp"
#include "calibration/latency/latency.hpp"

namespace birdseye::host {

/// What is known of the appliance whose latency was measured.
struct LatencySetting {
  std::optional<double> delay_ms;     ///< its [camera] delay_ms, as somebody said it
  std::optional<double> in_force_ms;  ///< what it takes off the frames' times by a calibration record
  bool into_record = false;           ///< what was measured is entered into a record
};

struct LatencyAdvice {
  std::string text;
  /// What to set [camera] delay_ms to. Empty: nobody said what it is, it would be below 0, or it is to stay as it is.
  std::optional<double> camera_delay_ms;
};

/// What to do about a latency, which is that of the frames' times before anything is taken off them by a record. They
/// follow from [camera] delay_ms, those of poses from [tracker] delay_ms: raising the first makes frames earlier.
LatencyAdvice advise_latency(const calibration::Latency& latency, const LatencySetting& setting);

/// Whether the frames' times are right with what the record in force takes off them: marginal where they are not,
/// unless what was measured is entered into a record, which mends that.
void judge_in_force(const calibration::Latency& latency, const LatencySetting& setting, Verdict& verdict);

}  // namespace birdseye::host
