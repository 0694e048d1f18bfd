#include <fmt/core.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <ctime>
#include <filesystem>
#include <sstream>
#include <stop_token>
#include <thread>

#include "device/birdseyed/appliance.hpp"
#include "device/birdseyed/patient_stderr.hpp"
#include "device/birdseyed/probe.hpp"
#include "device/birdseyed/recording.hpp"
#include "device/birdseyed/replay.hpp"
#include "device/birdseyed/service.hpp"
#include "drivers/system/monotonic.hpp"
#include "drivers/system/program.hpp"

namespace {

using namespace birdseye;
namespace fs = std::filesystem;

int refuse(const Error& error) {
  std::istringstream lines(error.what);
  for (std::string line; std::getline(lines, line);) print_error("birdseyed", line);
  return 2;
}

/// Signals are taken by one thread alone, and by waiting for them: no handler, nothing interrupted. To be made before
/// any other thread is, so that all inherit the mask.
class Signals {
 public:
  Signals() {
    sigemptyset(&awaited_);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&awaited_, signal);
    pthread_sigmask(SIG_BLOCK, &awaited_, nullptr);
    watcher_ = std::jthread([this](const std::stop_token& done) {
      while (!done.stop_requested()) {
        const timespec tick{0, 100'000'000};
        const int signal = sigtimedwait(&awaited_, nullptr, &tick);
        if (signal == SIGHUP) reload_ = true;
        if (signal == SIGTERM || signal == SIGINT) stop_.request_stop();
      }
    });
  }
  [[nodiscard]] std::stop_token stop() const { return stop_.get_token(); }
  bool take_reload() { return reload_.exchange(false); }

 private:
  sigset_t awaited_{};
  std::atomic<bool> reload_ = false;
  std::stop_source stop_;
  std::jthread watcher_;
};

/// Reads the configuration again. What cannot be used is said, and the appliance goes on as it was.
void reload(const fs::path& path, device::Config& config, wire::Server& server,
            std::unique_ptr<device::Appliance>& appliance) {
  device::notify_reloading();
  auto read = device::read_config(path);
  if (!read) {
    spdlog::error("configuration not taken, going on with the one before: {}", read.error().what);
  } else if (read->text == config.text && device::block_of(read->core) == device::block_of(config.core)) {
    spdlog::info("configuration unchanged");
  } else if (read->wire != config.wire) {
    spdlog::error(
        "configuration not taken, going on with the one before: [wire] cannot change while clients are connected; "
        "start birdseyed again");
  } else {
    appliance.reset();
    auto started = device::Appliance::start(*read, server);
    if (!started) {
      spdlog::error("configuration not taken, going on with the one before: {}", started.error().what);
      started = device::Appliance::start(config, server);
    } else {
      config = *read;
      spdlog::info("configuration read again");
    }
    if (started) appliance = *std::move(started);
  }
  device::notify_ready(appliance ? appliance->summary() : "cannot go on");
}

int serve(const fs::path& path, Signals& signals) {
  auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  auto server = wire::Server::listen(config->wire.bind, config->wire.port);
  if (!server) return refuse(server.error());
  auto started = device::Appliance::start(*config, **server);
  if (!started) return refuse(started.error());
  std::unique_ptr<device::Appliance> appliance = *std::move(started);
  spdlog::info("publishing on {} port {}", config->wire.bind, (*server)->port());
  device::notify_ready(appliance->summary());
  const auto stop = signals.stop();
  while (!stop.stop_requested() && appliance) {
    drivers::sleep_for(Duration::from_ms(500), stop);
    if (signals.take_reload()) reload(path, *config, **server, appliance);
    if (!appliance) break;
    if (appliance->alive()) device::notify_alive();
    device::notify_status(appliance->summary());
  }
  device::notify_stopping();
  spdlog::info("ending");
  return appliance ? 0 : 2;
}

int replay(const fs::path& path, const fs::path& recording, const Signals& signals) {
  const auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  const auto server = wire::Server::listen(config->wire.bind, config->wire.port);
  if (!server) return refuse(server.error());
  spdlog::info("replaying on {} port {}", config->wire.bind, (*server)->port());
  const auto done = device::replay(recording, **server, signals.stop());
  return done ? 0 : refuse(done.error());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"birdseyed: tracker and camera of a laparoscope cart, on one clock, over OpenIGTLink", "birdseyed"};
  fs::path config_path, recording;
  app.set_version_flag("--version", "birdseyed " BIRDSEYE_VERSION);
  bool check_only = false, probe_only = false;
  app.add_option("--config", config_path, "configuration file (TOML)")->required();
  CLI::Option* const check =
      app.add_flag("--check", check_only, "read the configuration, say whether it is sound, and end");
  CLI::Option* const probe =
      app.add_flag("--probe", probe_only, "open each instrument once, say what it is or what is wrong, and end")
          ->excludes(check);
  app.add_option("--replay", recording, "an appliance recording, to be published in place of instruments")
      ->excludes(check)
      ->excludes(probe);
  return run_program(app, argc, argv, [&] {
    if (check_only) {
      const auto config = device::read_config(config_path);
      if (!config) return refuse(config.error());
      fmt::print("{}: sound\n", config_path.string());
      return 0;
    }
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("birdseyed", std::make_shared<device::PatientStderr>()));
    Signals signals;
    if (probe_only) {
      const auto config = device::read_config(config_path);
      if (!config) return refuse(config.error());
      const auto faults = device::probe(*config, signals.stop());
      return faults ? 0 : refuse(faults.error());
    }
    return recording.empty() ? serve(config_path, signals) : replay(config_path, recording, signals);
  });
}
