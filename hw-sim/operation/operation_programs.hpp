#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "device/birdseyed/appliance.hpp"
#include "device/wire/server.hpp"
#include "host/operation/live_source.hpp"
#include "host/operation/live_workflow.hpp"
#include "hw-sim/faults/fault.hpp"
#include "hw-sim/local/local_camera.hpp"
#include "hw-sim/local/local_disk.hpp"
#include "hw-sim/local/local_line.hpp"
#include "hw-sim/local/local_link.hpp"
#include "hw-sim/operation/operation_recording.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// birdseyed and its server. An operation ends both and starts them again.
class ApplianceProgram {
 public:
  /// records: of the two scopes, as texts; empty where a scope has none. recording: null where nothing is recorded.
  ApplianceProgram(const OperationTruth& truth, const LocalLine& line, const LocalCamera& camera,
                   const LocalNetwork& network, std::array<std::string, 2> records, OperationRecording* recording);

  /// Starts it with the record of this scope, or ends it, where it does not run or end already.
  Result<void> run(bool on, std::size_t scope);
  /// Its machine loses its power, where it runs. It has to be ended then.
  void lose_power();
  /// Of all its queues.
  [[nodiscard]] std::vector<QueueFill> fills() const;

 private:
  device::Config config_;
  std::array<std::string, 2> records_;
  const LocalNetwork& network_;
  OperationRecording* recording_;
  std::unique_ptr<wire::Server> server_;
  std::unique_ptr<device::Appliance> appliance_;
};

/// The window, and its connection to the appliance.
class WindowProgram {
 public:
  using Open = std::function<Result<std::unique_ptr<host::LiveWorkflow>>()>;
  WindowProgram(Open open, const LocalNetwork& network) : open_(std::move(open)), network_(network) {}

  /// Opens it, or closes it, where it is not open or closed already. True: it was opened just now.
  Result<bool> run(bool on);
  [[nodiscard]] host::LiveWorkflow* workflow() const { return workflow_.get(); }
  [[nodiscard]] host::LiveSource& source() const { return *source_; }

 private:
  Open open_;
  const LocalNetwork& network_;
  std::unique_ptr<host::LiveWorkflow> workflow_;
  std::unique_ptr<host::LiveSource> source_;
};

/// The disk of the window's machine, and whether that machine has power.
class WindowDisk {
 public:
  WindowDisk(LocalDisk& disk, WindowProgram& window);
  ~WindowDisk();
  WindowDisk(const WindowDisk&) = delete;
  WindowDisk& operator=(const WindowDisk&) = delete;

  /// What befalls it now. Where it has power again, it has what the disk kept. True: it has power.
  Result<bool> befall(const FaultTimeline& befalling, double at_s);

 private:
  LocalDisk& disk_;
  WindowProgram& window_;
  bool cutting_ = false;
};

}  // namespace birdseye::hw_sim
