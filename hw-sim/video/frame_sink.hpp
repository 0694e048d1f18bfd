#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "calibration/base/result.hpp"
#include "hw-sim/video/camera_script.hpp"
#include "hw-sim/video/test_pattern.hpp"

namespace birdseye::hw_sim {

/// A picture as it lies in memory.
struct FramePixels {
  std::span<const std::uint8_t> pixels;
  FrameFormat format;
  int width_px, height_px;
};

/// Where a simulated camera's frames go.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Whether somebody takes the frames.
  [[nodiscard]] virtual bool connected() const = 0;
  /// Whether the latest frame has not gone out whole yet. Until then its pixels must stay as they are, and no other
  /// frame can begin.
  [[nodiscard]] virtual bool busy() const = 0;
  /// Begins to send a frame, with the faults that the plan has for it.
  virtual void begin(const FramePlan& plan, const FramePixels& picture) = 0;
  /// Goes on sending, accepts a reader that wants to connect, and returns at this time of CLOCK_MONOTONIC or earlier.
  virtual void work(std::int64_t until_ns) = 0;
  virtual void unplug() = 0;
  virtual Result<void> replug() = 0;
};

/// A Unix socket, as docs/manual/frame-socket.md has it; one reader after another.
Result<std::unique_ptr<FrameSink>> listen_for_frames(const std::filesystem::path& path, std::uint64_t seed);
/// A Video4Linux2 output node, as v4l2loopback makes them: a frame is a write().
Result<std::unique_ptr<FrameSink>> open_video_output(const std::filesystem::path& device, FrameFormat format,
                                                     int width_px, int height_px, double rate_hz, std::uint64_t seed);

}  // namespace birdseye::hw_sim
