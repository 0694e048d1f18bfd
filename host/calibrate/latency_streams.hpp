#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/latency/latency.hpp"
#include "drivers/system/progress.hpp"
#include "host/link/event_stream.hpp"

namespace birdseye::host {

/// What an appliance gave of its tracker and its camera, by its own clock.
struct LatencyStreams {
  std::vector<calibration::TimedMotionPose> tracker;
  std::vector<calibration::ImageMotion> video;
  std::size_t frames = 0, frames_without_motion = 0;
  std::string usual_reason;  ///< why the latest frame without motion had none
  std::string bird;          ///< whose poses these are
};

struct LatencySource {
  std::string bird = "scope";
  double seconds = 20;  ///< 0: until the stream ends
};

/// Takes the stream's events for so long. Errors: it gives no poses of that bird, or no frames.
Result<LatencyStreams> gather_streams(EventStream& stream, const LatencySource& source, Progress& progress);
/// From an appliance that runs, HOST:PORT.
Result<LatencyStreams> record_streams(const std::string& server, const LatencySource& source, Progress& progress);
/// From a recording, which birdseyed plays again at its own pace.
Result<LatencyStreams> replay_streams(const std::filesystem::path& recording, const LatencySource& source,
                                      Progress& progress);

}  // namespace birdseye::host
