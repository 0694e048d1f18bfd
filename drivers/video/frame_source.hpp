#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

/// One video frame, RGB, rows from the top, width * height * 3 bytes. Pixels are shared, never changed.
struct Frame {
  std::shared_ptr<const std::vector<std::uint8_t>> rgb;
  int width_px = 0, height_px = 0;
  std::uint64_t sequence = 0;  ///< the camera's own count: a hole is a frame the camera lost
  DeviceTime acquired;         ///< the middle of the exposure
  Duration acquired_sigma;
  DeviceTime arrived;
};

/// Of one frame. More than any laparoscope's; three bytes each are less than the largest message of the wire.
inline constexpr std::int64_t kMostPixels = std::int64_t{4096} * 4096;

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame; empty at the deadline; Errc::disconnected when the camera is gone.
  virtual Result<std::optional<Frame>> next(DeviceTime deadline) = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

struct CameraSettings {
  std::string source;  ///< v4l2:/dev/video0 or socket:/path
  int width_px = 0, height_px = 0;
  double rate_hz = 0;
};

/// Opens what settings.source names; an unknown kind is an error that says which there are.
Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings);

}  // namespace birdseye::drivers
