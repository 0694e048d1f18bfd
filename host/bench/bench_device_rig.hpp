#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <thread>
#include <vector>

#include "calibration/time/clock.hpp"
#include "device/wire/client.hpp"
#include "drivers/system/child_process.hpp"
#include "drivers/system/local_programs.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::host {

/// Settings of the simulated instruments.
struct DeviceRigSettings {
  std::filesystem::path folder;  ///< for configuration, logs and truth
  double tracker_rate_hz = 144;
  int width_px = 1920, height_px = 1080;
  double video_rate_hz = 60;
  double jitter_ms = 0, drift_ppm = 0;  ///< of both instruments
  bool stamps = true;                   ///< the camera knows when it took a frame
  double noise_mm = 0;
  std::string tracker_faults, camera_faults;  ///< texts of scripts; may be empty
};

/// What an instrument's simulator wrote down about itself.
struct InstrumentTruth {
  std::int64_t zero_ns = 0;
  double rate_hz = 0;
};

/// The begin or end of a fault that the simulator injected.
struct FaultTruth {
  std::string name;
  bool begins = true;
  DeviceTime at;
};

/// birdseyed at work on a simulated miniBIRD and a simulated camera, each a process of its own.
class DeviceRig {
 public:
  static Result<std::unique_ptr<DeviceRig>> start(const DeviceRigSettings& settings);
  ~DeviceRig();
  DeviceRig(const DeviceRig&) = delete;
  DeviceRig& operator=(const DeviceRig&) = delete;

  [[nodiscard]] int port() const { return port_; }
  /// Processor time that birdseyed has used, s, and what it holds in memory, MB, now and at most.
  [[nodiscard]] double cpu_s() const;
  [[nodiscard]] double resident_mb() const;
  /// The truth as the simulator has written it so far.
  [[nodiscard]] Result<InstrumentTruth> tracker_truth() const;
  [[nodiscard]] Result<InstrumentTruth> camera_truth() const;
  [[nodiscard]] std::vector<FaultTruth> faults() const;

 private:
  DeviceRig(DeviceRigSettings settings, int port) : settings_(std::move(settings)), port_(port) {}
  Result<void> start_instrument(const std::string& name, std::vector<std::string> arguments, const std::string& faults);
  void listen(ChildProcess& child, const std::stop_token& stop);

  DeviceRigSettings settings_;
  int port_;
  std::unique_ptr<RendezvousFolder> rendezvous_;
  std::vector<std::unique_ptr<ChildProcess>> instruments_;
  std::unique_ptr<ChildProcess> appliance_;
  mutable std::mutex mutex_;
  std::vector<FaultTruth> faults_;
  std::vector<OwnedThread> listeners_;
};

}  // namespace birdseye::host
