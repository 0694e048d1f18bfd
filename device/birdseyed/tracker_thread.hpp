#pragma once

#include <functional>
#include <stop_token>

#include "device/birdseyed/config.hpp"
#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/minibird/minibird.hpp"

namespace birdseye::device {

/// Finds the tracker, starts it, hands over its bytes, and begins again when it is lost or falls silent. Returns at
/// stop.
void run_tracker(const TrackerConfig& config, InstrumentPost& post, const std::stop_token& stop);

/// Finds the tracker and starts it, trying once; calls `still` meanwhile.
Result<std::unique_ptr<drivers::minibird::MiniBird>> open_tracker(const TrackerConfig& config,
                                                                  const std::stop_token& stop,
                                                                  const std::function<void()>& still = {});
/// One line that says what the tracker is.
std::string describe(const drivers::minibird::MiniBird& tracker, const std::string& device);

}  // namespace birdseye::device
