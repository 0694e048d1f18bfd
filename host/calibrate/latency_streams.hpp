#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/latency/latency.hpp"
#include "drivers/system/progress.hpp"
#include "host/link/event_source.hpp"
#include "host/link/event_stream.hpp"

namespace birdseye::host {

/// Poses and picture motion that an appliance gave, both by the appliance's clock.
struct LatencyStreams {
  std::vector<calibration::TimedMotionPose> tracker;
  std::vector<calibration::ImageMotion> video;
  std::size_t frames = 0, frames_without_motion = 0;
  std::string usual_reason;  ///< why the latest frame without motion had none
  std::string bird;          ///< whose poses these are
  /// What the appliance takes off the frames' times by its calibration record, at the latest frame. The motion above is
  /// by the times before that.
  std::optional<double> in_force_ms;
  Drops drops;
};

struct LatencySource {
  std::string bird = "scope";
  double seconds = 20;  ///< 0: until the stream ends
};

/// Takes the stream's events for source.seconds. Errors: the stream gives no poses of the bird, or no frames.
Result<LatencyStreams> gather_events(EventSource& events, const LatencySource& source, Progress& progress);
/// Likewise, and says what this machine could not take in time.
Result<LatencyStreams> gather_streams(EventStream& stream, const LatencySource& source, Progress& progress);
/// From an appliance that runs, HOST:PORT.
Result<LatencyStreams> record_streams(const std::string& server, const LatencySource& source, Progress& progress);
/// From an appliance recording, which birdseyed replays at its own pace.
Result<LatencyStreams> replay_streams(const std::filesystem::path& recording, const LatencySource& source,
                                      Progress& progress);

/// Whether the path is a session recording: a folder with its events.
bool is_session(const std::filesystem::path& recording);
/// From a session recording. events_sha256: as RecordingReader::Settings has it. source.bird: as the server named it
/// that was recorded.
Result<LatencyStreams> session_streams(const std::filesystem::path& recording, const std::string& events_sha256,
                                       const LatencySource& source, Progress& progress);

}  // namespace birdseye::host
