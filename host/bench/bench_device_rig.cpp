#include "host/bench/bench_device_rig.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/system/clock.hpp"
#include "drivers/system/local_programs.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

Result<InstrumentTruth> read_truth(const std::filesystem::path& path) {
  std::ifstream in(path);
  const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("zero_monotonic_ns") || !json.contains("rate_hz"))
    return Error{Errc::bad_format, fmt::format("{}: the simulator's truth is not there yet", path.string())};
  return InstrumentTruth{json["zero_monotonic_ns"].get<std::int64_t>(), json["rate_hz"].get<double>()};
}

}  // namespace

Result<void> DeviceRig::start_instrument(const std::string& name, std::vector<std::string> arguments,
                                         const std::string& faults) {
  arguments.insert(arguments.begin(), {beside_us("birdseye-sim"), name});
  arguments.insert(arguments.end(),
                   {"--jitter-ms", fmt::format("{}", settings_.jitter_ms), "--drift-ppm",
                    fmt::format("{}", settings_.drift_ppm), "--truth", (settings_.folder / (name + ".json")).string()});
  if (!faults.empty()) {
    const auto script = settings_.folder / (name + "_faults.toml");
    if (auto written = write_file(script, faults); !written) return written;
    arguments.insert(arguments.end(), {"--faults", script.string()});
  }
  auto child =
      ChildProcess::start(arguments, settings_.folder / (name + ".log"), ChildProcess::Pipe::stdout_from_child);
  if (!child) return std::move(child).error();
  const auto line = child->read_line(Deadline::after(Duration::from_ms(20'000)));
  if (!line) return line.error();
  if (!*line) return Error{Errc::timeout, fmt::format("birdseye-sim {}: not ready within 20 s", name)};
  instruments_.push_back(std::make_unique<ChildProcess>(std::move(*child)));
  ChildProcess* const running = instruments_.back().get();
  listeners_.emplace_back([this, running](const std::stop_token& stop) { listen(*running, stop); });
  return {};
}

Result<std::unique_ptr<DeviceRig>> DeviceRig::start(const DeviceRigSettings& settings) {
  const auto port = free_port();
  if (!port) return port.error();
  std::unique_ptr<DeviceRig> rig(new DeviceRig(settings, *port));
  auto rendezvous = RendezvousFolder::make();
  if (!rendezvous) return std::move(rendezvous).error();
  rig->rendezvous_ = *std::move(rendezvous);
  std::error_code ignored;
  std::filesystem::create_directories(settings.folder, ignored);
  const std::string tty = (rig->rendezvous_->path() / "tracker").string(),
                    socket = (rig->rendezvous_->path() / "camera").string();
  const std::string size = fmt::format("{}x{}", settings.width_px, settings.height_px);
  const std::string noise = fmt::format("{}", settings.noise_mm);
  if (auto started = rig->start_instrument("minibird", {"--tty", tty, "--boot-ms", "0", "--position-noise-mm", noise},
                                           settings.tracker_faults);
      !started)
    return started.error();
  std::vector<std::string> camera{"--socket", socket,   "--size",
                                  size,       "--rate", fmt::format("{}", settings.video_rate_hz)};
  if (!settings.stamps) camera.emplace_back("--no-stamps");
  if (auto started = rig->start_instrument("camera", std::move(camera), settings.camera_faults); !started)
    return started.error();
  const std::string config = fmt::format(
      "[tracker]\ndevice = \"{}\"\nrate_hz = {}\nfrozen_after = 0\n[camera]\nsource = \"socket:{}\"\nwidth = {}\n"
      "height = {}\nrate_hz = {}\ndelay_ms = 12\n[wire]\nport = {}\n",
      tty, settings.tracker_rate_hz, socket, settings.width_px, settings.height_px, settings.video_rate_hz, *port);
  if (auto written = write_file(settings.folder / "birdseyed.toml", config); !written) return written.error();
  auto appliance =
      ChildProcess::start({beside_us("birdseyed"), "--config", (settings.folder / "birdseyed.toml").string()},
                          settings.folder / "birdseyed.log");
  if (!appliance) return std::move(appliance).error();
  rig->appliance_ = std::make_unique<ChildProcess>(std::move(*appliance));
  return rig;
}

DeviceRig::~DeviceRig() {
  for (OwnedThread& listener : listeners_) listener.request_stop();
  for (OwnedThread& listener : listeners_) listener.join();
  if (appliance_) appliance_->stop();
  for (auto& instrument : instruments_) instrument->stop();
}

void DeviceRig::listen(ChildProcess& child, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto line = child.read_line(Deadline::after(Duration::from_ms(100)));
    if (!line) return;
    if (!*line) continue;
    const nlohmann::json json = nlohmann::json::parse(**line, nullptr, false);
    if (!json.is_object() || json.value("event", "") != "fault") continue;
    const std::lock_guard lock(mutex_);
    faults_.push_back({json.value("name", ""), json.value("phase", "") == "begin",
                       DeviceTime{json.value("monotonic_ns", std::int64_t{0})}});
  }
}

double DeviceRig::cpu_s() const {
  std::ifstream in(fmt::format("/proc/{}/stat", appliance_->pid()));
  std::string text;
  std::getline(in, text);
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

double DeviceRig::resident_mb() const {
  std::ifstream in(fmt::format("/proc/{}/status", appliance_->pid()));
  for (std::string line; std::getline(in, line);) {
    double kib = 0;
    if (std::sscanf(line.c_str(), "VmRSS: %lf", &kib) == 1) return kib * 1024e-6;
  }
  return 0;
}

Result<InstrumentTruth> DeviceRig::tracker_truth() const {
  return read_truth(settings_.folder / "minibird.json");
}

Result<InstrumentTruth> DeviceRig::camera_truth() const {
  return read_truth(settings_.folder / "camera.json");
}

std::vector<FaultTruth> DeviceRig::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

}  // namespace birdseye::host
