#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"

namespace birdseye::host {

struct DeviceStudyOptions {
  double seconds = 60;  ///< of the load
  int clients = 2;      ///< that take everything
};

/// `birdseye bench device`: runs birdseyed on simulated instruments; measures its load, how true its times are, and how
/// long it takes to recover from faults. Ends early, with Errc::disconnected, once interrupted(). Gives the figures.
Result<nlohmann::json> device_study(const DeviceStudyOptions& options);

}  // namespace birdseye::host
