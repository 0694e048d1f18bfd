#include <fmt/core.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <ctime>
#include <filesystem>
#include <stop_token>
#include <thread>

#include "calibration/base/program.hpp"
#include "device/birdseyed/appliance.hpp"

namespace {

int refuse(const birdseye::Error& error) {
  birdseye::print_error("birdseyed", error.what);
  return 2;
}

int serve(const std::filesystem::path& config_path, bool check_only) {
  using namespace birdseye;
  const auto config = device::read_config(config_path);
  if (!config) return refuse(config.error());
  if (check_only) {
    fmt::print("{}: sound\n", config_path.string());
    return 0;
  }
  spdlog::set_default_logger(spdlog::stderr_color_mt("birdseyed"));

  // Signals are taken by this thread alone, and by waiting for them: no handler, nothing interrupted.
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  std::stop_source stop;
  std::jthread watcher([&](const std::stop_token& done) {
    while (!done.stop_requested()) {
      const timespec tick{0, 100'000'000};
      if (sigtimedwait(&ending, nullptr, &tick) > 0) stop.request_stop();
    }
  });
  const auto appliance = device::Appliance::start(*config, stop.get_token());
  if (!appliance) return stop.stop_requested() ? 0 : refuse(appliance.error());
  while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  spdlog::info("ending");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"birdseyed: tracker and camera of a laparoscope cart, on one clock, over OpenIGTLink", "birdseyed"};
  std::filesystem::path config_path;
  bool check_only = false;
  app.add_option("--config", config_path, "configuration file (TOML)")->required();
  app.add_flag("--check", check_only, "read the configuration, say whether it is sound, and end");
  return birdseye::run_program(app, argc, argv, [&] { return serve(config_path, check_only); });
}
