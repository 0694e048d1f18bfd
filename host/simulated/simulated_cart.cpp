#include "host/simulated/simulated_cart.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/system/interrupt.hpp"
#include "drivers/system/json_file.hpp"
#include "drivers/system/local_programs.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kLook = Duration::from_ms(100);  // how soon a stop is seen

Result<CartSheet> read_sheet(const std::filesystem::path& path) {
  const auto json = read_json_file(path);
  if (!json) return json.error();
  try {
    CartSheet sheet;
    sheet.board = json->at("board").get<std::string>();
    const auto tip = json->at("tip_in_sensor_mm").get<std::vector<double>>();
    if (tip.size() != 3)
      return Error{Errc::bad_format, fmt::format("{}: tip_in_sensor_mm needs 3 numbers", path.string())};
    sheet.tip_in_pointer_mm = {tip[0], tip[1], tip[2]};
    sheet.fiducials = json->at("fiducials").get<int>();
    return sheet;
  } catch (const nlohmann::json::exception&) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), kPartMissing)};
  }
}

Result<void> write_appliance_config(const std::filesystem::path& path, const SimulatedCartSettings& settings,
                                    const std::filesystem::path& tty, const std::filesystem::path& socket, int port) {
  return write_file(path, fmt::format(R"([tracker]
device = "{}"
baud = 115200
birds = {}
names = ["scope", "pointer"{}
rate_hz = 103.3
frozen_after = 0
most_speed_mm_s = 6000
most_turn_deg_s = 3000
hemisphere = "forward"
record = "position_matrix"
delay_ms = 7.5

[camera]
source = "socket:{}"
width = {}
height = {}
rate_hz = {}

[wire]
bind = "127.0.0.1"
port = {}

[pose]
max_age_ms = 100
max_gap_ms = 60
smoothing_ms = {}
wait_ms = {}
)",
                                      tty.string(), settings.reference.empty() ? 2 : 3,
                                      settings.reference.empty() ? "]" : ", \"reference\"]\nreference = \"reference\"",
                                      socket.string(), settings.width_px, settings.height_px, settings.video_rate_hz,
                                      port, settings.smoothing_ms, settings.wait_ms));
}

}  // namespace

Result<void> SimulatedCart::make_patient(const SimulatedCartSettings& settings) {
  std::vector<std::string> command{beside_us("birdseye-sim"),
                                   "--end-with-stdin",
                                   "phantom",
                                   "--out",
                                   (settings.folder / "phantom").string(),
                                   "--seed",
                                   std::to_string(settings.seed)};
  if (!settings.ct.empty()) command.insert(command.end(), {"--ct", settings.ct.string()});
  const std::filesystem::path log = settings.folder / "simulator.log";
  auto child = ChildProcess::start(command, log, ChildProcess::Pipe::none, ChildProcess::Signals::with_us,
                                   ChildProcess::Life::ours);
  if (!child) return std::move(child).error();
  std::optional<int> code;
  for (const Deadline deadline = Deadline::after(Duration::from_ms(60'000));
       !code && !deadline.passed() && !interrupted();) {
    code = child->wait(Deadline::after(kLook));
  }
  if (code == 0) return {};
  if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
  std::ifstream in(log);
  std::string line, last;
  while (std::getline(in, line)) {
    if (!line.empty()) last = line;
  }
  return Error{code ? Errc::bad_value : Errc::timeout,
               fmt::format("the simulated patient could not be made: {}", last.empty() ? "it took over 60 s" : last)};
}

std::vector<std::string> deformation_kinds() {
  return {"elastic", "bezier", "bend", "push", "compression", "twist", "breathing", "pneumoperitoneum"};
}

Result<std::unique_ptr<SimulatedCart>> SimulatedCart::start(const SimulatedCartSettings& settings) {
  const std::filesystem::path& folder = settings.folder;
  auto rendezvous = RendezvousFolder::make();
  if (!rendezvous) return std::move(rendezvous).error();
  const std::filesystem::path socket = (*rendezvous)->path() / "camera";
  const std::filesystem::path tty = (*rendezvous)->path() / "tracker";

  const Result<int> port = free_port();
  if (!port) return port.error();

  std::vector<std::string> command{beside_us("birdseye-sim"),
                                   "--end-with-stdin",
                                   "cart",
                                   "--phantom",
                                   (folder / "phantom").string(),
                                   "--socket",
                                   socket.string(),
                                   "--tty",
                                   tty.string(),
                                   "--out",
                                   folder.string(),
                                   "--seed",
                                   std::to_string(settings.seed),
                                   "--deformation-mm",
                                   fmt::format("{}", settings.deformation_mm),
                                   "--position-noise-mm",
                                   fmt::format("{}", settings.position_noise_mm),
                                   "--angle-noise-deg",
                                   fmt::format("{}", settings.angle_noise_deg),
                                   "--size",
                                   fmt::format("{}x{}", settings.width_px, settings.height_px),
                                   "--rate",
                                   fmt::format("{}", settings.video_rate_hz),
                                   "--dwell-s",
                                   fmt::format("{}", settings.dwell_s),
                                   "--pause-s",
                                   fmt::format("{}", settings.pause_s),
                                   "--look-s",
                                   fmt::format("{}", settings.look_s)};
  if (!settings.deformation.empty()) command.insert(command.end(), {"--deformation", settings.deformation});
  if (settings.strokes) command.emplace_back("--strokes");
  if (settings.views) command.emplace_back("--views");
  if (settings.drop_late) command.emplace_back("--drop-late");
  if (!settings.reference.empty()) command.insert(command.end(), {"--reference", settings.reference});
  if (!settings.faults.empty()) command.insert(command.end(), {"--faults", settings.faults.string()});
  auto simulator = ChildProcess::start(command, folder / "simulator.log", ChildProcess::Pipe::stdout_from_child,
                                       ChildProcess::Signals::with_us, ChildProcess::Life::ours);
  if (!simulator) return std::move(simulator).error();
  const auto line = simulator->read_line(Deadline::after(Duration::from_ms(120'000)));
  if (!line) return line.error();
  if (!*line || line->value().find("\"ready\"") == std::string::npos) {
    return Error{Errc::timeout, "birdseye-sim: not ready within 120 s; see simulator.log"};
  }
  auto sheet = read_sheet(folder / "cart.json");
  if (!sheet) return std::move(sheet).error();

  if (auto written = write_appliance_config(folder / "birdseyed.toml", settings, tty, socket, *port); !written) {
    return written.error();
  }
  auto appliance = ChildProcess::start(
      {beside_us("birdseyed"), "--end-with-stdin", "--config", (folder / "birdseyed.toml").string()},
      folder / "birdseyed.log", ChildProcess::Pipe::none, ChildProcess::Signals::with_us, ChildProcess::Life::ours);
  if (!appliance) return std::move(appliance).error();

  std::unique_ptr<SimulatedCart> cart(new SimulatedCart(std::move(*simulator), std::move(*sheet), *port));
  cart->rendezvous_ = *std::move(rendezvous);
  cart->appliance_ = std::make_unique<ChildProcess>(std::move(*appliance));
  return cart;
}

SimulatedCart::SimulatedCart(ChildProcess simulator, CartSheet sheet, int port)
    : simulator_(std::move(simulator)), sheet_(std::move(sheet)), port_(port) {
  listener_ = OwnedThread([this](const std::stop_token& stop) { listen(stop); });
}

SimulatedCart::~SimulatedCart() {
  listener_.request_stop();
  listener_.join();
  if (appliance_) appliance_->stop();
  simulator_.stop();
}

void SimulatedCart::listen(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto line = simulator_.read_line(Deadline::after(kLook));
    if (!line) {
      const std::lock_guard lock(mutex_);
      if (stages_.empty() || stages_.back().name != "end") failure_ = line.error().what;
      return;
    }
    if (!*line) continue;
    const nlohmann::json json = nlohmann::json::parse(**line, nullptr, false);
    if (!json.is_object() || json.value("event", "") != "stage") continue;
    const std::lock_guard lock(mutex_);
    stages_.push_back({json.value("name", ""), DeviceTime{json.value("monotonic_ns", std::int64_t{0})}});
  }
}

std::vector<CartStage> SimulatedCart::stages() const {
  const std::lock_guard lock(mutex_);
  return stages_;
}

std::string SimulatedCart::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

Result<void> SimulatedCart::finish(Deadline deadline) {
  listener_.request_stop();
  listener_.join();
  const std::optional<int> code = simulator_.wait(deadline);
  if (!code) return Error{Errc::timeout, "birdseye-sim: did not end; see simulator.log"};
  if (*code != 0) return Error{Errc::io, fmt::format("birdseye-sim: ended with code {}; see simulator.log", *code)};
  return {};
}

}  // namespace birdseye::host
