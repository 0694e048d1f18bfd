#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"

namespace birdseye::host {

struct WireStudyOptions {
  double seconds = 10;  ///< of each measurement
  int rounds = 3;       ///< of both ways in turn
};

/// `birdseye bench wire`: 1080p60 from the wire's server to its client, plain and by TLS in turn, over this machine's
/// own network: the processor time of each end, and the frames that were lost. Ends early, with Errc::disconnected,
/// once interrupted().
Result<nlohmann::json> wire_study(const WireStudyOptions& options);

}  // namespace birdseye::host
