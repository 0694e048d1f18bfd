#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

/// One video frame, RGB, rows from the top, width * height * 3 bytes. Pixels are shared, never changed.
struct Frame {
  std::shared_ptr<const std::vector<std::uint8_t>> rgb;
  int width_px = 0, height_px = 0;
  std::uint64_t sequence = 0;  ///< the camera's own count: a hole is a frame that was lost
  /// The middle of the exposure and its sigma, if acquired_known; else both are zero and only `arrived` is known.
  DeviceTime acquired;
  Duration acquired_sigma;
  bool acquired_known = false;
  DeviceTime arrived;
  Duration stamp_ahead;  ///< how far the camera's stamp lay ahead of arrived: some drivers stamp an end yet to come
};

/// The most pixels of a frame: more than any laparoscope has, and with three bytes each less than the largest message
/// of the wire.
inline constexpr std::int64_t kMostPixels = std::int64_t{4096} * 4096;

/// The most that a frame's number can be: a camera of a thousand frames a second counts so far in 140,000 years.
inline constexpr std::uint64_t kMostSequence = std::uint64_t{1} << 52U;

struct CameraSettings {
  std::string source;  ///< v4l2:/dev/video0 or socket:/path
  int width_px = 0, height_px = 0;
  double rate_hz = 0;
  // Below: Video4Linux only. Empty: as the camera has it.
  std::string format = {};  ///< by its Video4Linux name (YUYV, MJPG, ...); empty: whichever costs least
  std::optional<double> exposure_us = std::nullopt;
  std::optional<int> gain = std::nullopt;  ///< in the camera's own units
  std::optional<int> white_balance_k = std::nullopt;
  std::optional<Duration> readout = std::nullopt;  ///< from the end of the exposure to the last pixel
};

/// Since the camera was opened.
struct FrameCounters {
  std::uint64_t frames = 0;      ///< given to the caller
  std::uint64_t incomplete = 0;  ///< flagged damaged by the driver, cut short, or not to be decoded: dropped
  std::uint64_t gaps = 0;        ///< frames missing by the camera's own count
};

/// What became of a wish about the camera's controls, a line of text each.
struct ControlReport {
  std::vector<std::string> done;     ///< "exposure 5000 us"
  std::vector<std::string> refused;  ///< "gain: the camera has none"
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame; empty at the deadline, and earlier where one was damaged; Errc::disconnected when the camera is
  /// gone: open it again.
  virtual Result<std::optional<Frame>> next(Deadline deadline) = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
  /// One line: device, driver, format, size, rate, stamps.
  [[nodiscard]] virtual std::string describe() const = 0;
  /// What distinguishes this camera from another: "model", and "serial" where it has one.
  [[nodiscard]] virtual std::map<std::string, std::string> identity() const = 0;
  [[nodiscard]] virtual FrameCounters counters() const = 0;
  /// The rate that the camera says it has, whatever was asked for; 0: it does not say.
  [[nodiscard]] virtual double rate_hz() const { return 0; }
  /// The exposure, where the camera tells it and does not change it by itself.
  [[nodiscard]] virtual std::optional<Duration> exposure() const { return std::nullopt; }
  /// What became of exposure, gain and white balance as set.
  [[nodiscard]] virtual ControlReport controls() const { return {}; }
  /// Holds exposure, gain, white balance and focus as they are now, until unlock_controls().
  virtual ControlReport lock_controls() { return {}; }
  virtual ControlReport unlock_controls() { return {}; }
  /// Stops and starts the stream, for a driver that has stopped giving frames and says nothing.
  virtual Result<void> restart_stream() { return {}; }
};

/// Settings that open_camera() could never take, found without a camera: "key: why".
std::vector<std::string> faults_of(const CameraSettings& settings);
/// Opens what settings.source names. For an unknown kind the error says which kinds there are.
Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings);

}  // namespace birdseye::drivers
