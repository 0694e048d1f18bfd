#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "device/wire/client.hpp"
#include "drivers/system/thread.hpp"
#include "host/bench/bench_device_rig.hpp"

namespace birdseye::host {

/// Everything one client is told until it is stopped, on a thread of its own; frames without their pixels.
class DeviceListener {
 public:
  explicit DeviceListener(std::unique_ptr<wire::Client> client) : client_(std::move(client)) {
    thread_ = OwnedThread([this](const std::stop_token& stop) { run(stop); });
  }
  ~DeviceListener() { stop(); }
  DeviceListener(const DeviceListener&) = delete;
  DeviceListener& operator=(const DeviceListener&) = delete;
  void stop() {
    thread_.request_stop();
    thread_.join();
  }
  /// Whether a frame with a pose has come by now.
  [[nodiscard]] bool posed() const { return posed_; }

  struct Heard {
    wire::FrameInfo info;
    DeviceTime at;
  };
  // To be read once it is stopped.
  std::vector<Heard> frames;
  std::vector<DeviceTime> birds;     ///< acquired
  std::vector<DeviceTime> birds_at;  ///< came
  std::vector<wire::Health> healths;
  std::optional<Error> ended;

 private:
  void run(const std::stop_token& stop);

  std::unique_ptr<wire::Client> client_;
  std::atomic<bool> posed_ = false;
  OwnedThread thread_;
};

/// The instruments, birdseyed, and those who listen to it.
struct DeviceSession {
  /// poses_alone: one client more, that takes poses alone. Errc::timeout where no frame with a pose comes.
  static Result<DeviceSession> start(const DeviceRigSettings& settings, int clients, bool poses_alone = false);

  std::unique_ptr<DeviceRig> rig;
  std::vector<std::unique_ptr<DeviceListener>> listeners;
};

}  // namespace birdseye::host
