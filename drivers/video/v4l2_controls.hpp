#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::drivers {

/// A camera's controls by Video4Linux's numbers (V4L2_CID_...).
class ControlPort {
 public:
  struct Range {
    int least = 0, most = 0;
  };
  virtual ~ControlPort() = default;
  /// Empty: the camera has no such control.
  virtual std::optional<Range> range(std::uint32_t id) = 0;
  virtual std::optional<int> get(std::uint32_t id) = 0;
  virtual Result<void> set(std::uint32_t id, int value) = 0;
};

/// Sets exposure, gain, white balance and focus, and holds those that the camera would otherwise change by itself.
class V4l2Controls {
 public:
  explicit V4l2Controls(ControlPort& port) : port_(port) {}
  ControlReport apply(const CameraSettings& settings);
  /// Switches every automatism off and keeps the value that it had. A second call does nothing.
  ControlReport lock();
  /// Switches those automatisms on again that lock() switched off.
  ControlReport unlock();
  /// The exposure, where the camera does not change it by itself.
  [[nodiscard]] std::optional<Duration> exposure();

 private:
  struct Automatism;
  static const Automatism kAutomatisms[];
  static std::string value_text(std::uint32_t id, int value);
  Result<void> switch_off(const Automatism& automatism);
  void hold(const Automatism& automatism, ControlReport& report);
  void set_value(const Automatism& automatism, int value, ControlReport& report);

  ControlPort& port_;
  std::map<std::uint32_t, int> before_lock_;  // of automatisms
};

}  // namespace birdseye::drivers
