#include "hw-sim/operation/operation_programs.hpp"

#include <algorithm>
#include <iterator>

#include "device/wire/client.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/disk_keeper.hpp"
#include "hw-sim/operation/operation_faults.hpp"

namespace birdseye::hw_sim {

namespace {

device::Config config_of(const OperationTruth& truth, const LocalLine& line, const LocalCamera& camera) {
  device::Config config;
  config.tracker.line.device = "/sim/tracker";
  config.tracker.open_line = [&line](const auto&) { return line.open(); };
  config.tracker.minibird.birds = static_cast<int>(truth.birds());
  config.core.bird_names = {"scope", "pointer"};
  if (truth.birds() > 2) {
    config.core.bird_names.emplace_back(kReference);
    config.tracker.reference = kReference;
  }
  config.core.pose.smoothing = Duration::from_ms(40);
  config.core.pose_wait = Duration::from_ms(60);
  config.camera.width_px = truth.lens(0).width_px;
  config.camera.height_px = truth.lens(0).height_px;
  config.camera.rate_hz = kVideo_hz;
  config.open_camera = [&camera](const auto&) { return camera.open(); };
  return config;
}

}  // namespace

ApplianceProgram::ApplianceProgram(const OperationTruth& truth, const LocalLine& line, const LocalCamera& camera,
                                   const LocalNetwork& network, std::array<std::string, 2> records,
                                   OperationRecording* recording)
    : config_(config_of(truth, line, camera)), records_(std::move(records)), network_(network), recording_(recording) {
  if (recording != nullptr) config_.record = recording->config();
}

Result<void> ApplianceProgram::run(bool on, std::size_t scope) {
  if (on == (appliance_ != nullptr)) return {};
  appliance_.reset();
  server_.reset();
  if (!on) return {};
  config_.core.calibration = records_[scope];
  server_ = wire::Server::over(network_.listener());
  auto started = device::Appliance::start(config_, *server_);
  if (!started) return std::move(started).error();
  appliance_ = *std::move(started);
  return {};
}

void ApplianceProgram::lose_power() {
  if (appliance_ == nullptr) return;
  network_.fall_silent();
  if (recording_ != nullptr) recording_->lose_power(host_now());
}

std::vector<QueueFill> ApplianceProgram::fills() const {
  if (appliance_ == nullptr) return {};
  std::vector<QueueFill> out = appliance_->fills();
  std::ranges::move(server_->fills(), std::back_inserter(out));
  return out;
}

Result<bool> WindowProgram::run(bool on) {
  if (on == (workflow_ != nullptr)) return false;
  source_.reset();
  workflow_.reset();
  if (!on) return false;
  auto opened = open_();
  if (!opened) return std::move(opened).error();
  workflow_ = *std::move(opened);
  source_ = host::LiveSource::of_client("the appliance", [this]() -> Result<std::unique_ptr<wire::Client>> {
    return wire::Client::over(network_.connect(), "the appliance");
  });
  return true;
}

WindowDisk::WindowDisk(LocalDisk& disk, WindowProgram& window) : disk_(disk), window_(window) {
  DiskKeeper::put(&disk);
}

WindowDisk::~WindowDisk() {
  DiskKeeper::put(nullptr);
}

Result<bool> WindowDisk::befall(const FaultTimeline& befalling, double at_s) {
  const Fault* const late = befalling.active(FaultKind::disk_late);
  disk_.set_late(Duration::from_seconds(late != nullptr ? late->value("ms") * 1e-3 : 0));
  disk_.set_full(befalling.active(FaultKind::disk_full) != nullptr);
  const Fault* const cut = befalling.active(FaultKind::power_cut);
  if (cut != nullptr) {
    if (!std::exchange(cutting_, true)) disk_.lose_power_after(static_cast<std::uint64_t>(cut->value("after_syncs")));
    // Where nothing is written any more.
    if (at_s > cut->at_s + cut->for_s.value_or(0) / 2) disk_.lose_power();
    return !disk_.powerless();
  }
  if (!std::exchange(cutting_, false)) return true;
  disk_.lose_power();
  if (const auto closed = window_.run(false); !closed) return closed.error();
  if (const auto up = disk_.power_up(); !up) return up.error();
  return true;
}

}  // namespace birdseye::hw_sim
