#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "device/birdseyed/appliance.hpp"
#include "device/birdseyed/patient_stderr.hpp"
#include "device/birdseyed/probe.hpp"
#include "device/birdseyed/recording.hpp"
#include "device/birdseyed/replay.hpp"
#include "device/birdseyed/safe_mode.hpp"
#include "device/birdseyed/service.hpp"
#include "device/birdseyed/wire_admission.hpp"
#include "device/wire/pairing.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/identity/identity_folder.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/service_signals.hpp"
#include "drivers/system/starter.hpp"
#include "drivers/system/wait.hpp"

namespace {

using namespace birdseye;
namespace fs = std::filesystem;

constexpr Duration kPairingWindow = Duration::from_ms(120'000);
constexpr int kUnusable = static_cast<int>(ExitCode::unusable_input);

int refuse(const Error& error) {
  std::istringstream lines(error.what);
  for (std::string line; std::getline(lines, line);) print_error("birdseyed", line);
  return kUnusable;
}

/// Reads the configuration again. What cannot be used is said, and the appliance goes on as it was.
void reload(const fs::path& path, device::Config& config, wire::Server& server,
            const std::vector<std::string>& left_out, std::unique_ptr<device::Appliance>& appliance) {
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
    auto started = device::Appliance::start(*read, server, left_out);
    if (!started) {
      spdlog::error("configuration not taken, going on with the one before: {}", started.error().what);
      started = device::Appliance::start(config, server, left_out);
    } else {
      config = *read;
      spdlog::info("configuration read again");
    }
    if (started) appliance = *std::move(started);
  }
  device::notify_ready(appliance ? appliance->summary() : "cannot go on");
}

/// Says whether a start would take the configuration, and what it would do without.
int check_start(const fs::path& path) {
  const auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  if (const auto wire = device::check_wire(config->wire); !wire) return refuse(wire.error());
  const std::string& record_refused =
      config->core.calibration_refused.empty() ? config->calibration_unbound : config->core.calibration_refused;
  for (const std::string& refused : {record_refused, config->core.field_refused}) {
    if (!refused.empty()) print_error("birdseyed", refused);
  }
  if (const std::string& who = config->core.field_unsigned; !who.empty())
    print_error("birdseyed", fmt::format("UNSIGNED: the map of the field is {}", who));
  const char* without = !config->core.field_refused.empty() ? ", but no pose will be published"
                        : !record_refused.empty()           ? ", but the record will not be used"
                                                            : "";
  print_line(fmt::format("{}: sound{}", path.string(), without));
  if (const std::string who = device::admission_words(config->wire); !who.empty()) print_line(who);
  return 0;
}

int serve(const fs::path& path, ServiceSignals& signals, device::SafeMode& safe_mode) {
  auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  auto admission = device::admission_of(config->wire);
  if (!admission) return refuse(admission.error());
  device::KnownKeysWatch known(admission->tls);
  auto server = wire::Server::listen(config->wire.bind, config->wire.port, *std::move(admission));
  if (!server) return refuse(server.error());
  auto started = device::Appliance::start(*config, **server, safe_mode.left_out());
  if (!started) return refuse(started.error());
  std::unique_ptr<device::Appliance> appliance = *std::move(started);
  spdlog::info("publishing on {} port {}", config->wire.bind, (*server)->port());
  device::notify_ready(appliance->summary());
  const auto stop = signals.stop();
  while (!stop.stop_requested() && appliance) {
    sleep_for(Duration::from_ms(500), stop);
    if (signals.take_reload()) reload(path, *config, **server, safe_mode.left_out(), appliance);
    if (!appliance) break;
    const std::string hanging = appliance->hanging();
    safe_mode.note_hang(hanging);
    if (hanging.empty()) device::notify_alive();
    const std::string& fault = known.look();
    device::notify_status(appliance->summary() + (fault.empty() ? "" : "; " + fault));
  }
  device::notify_stopping();
  spdlog::info("ending");
  return appliance ? 0 : kUnusable;
}

/// In $RUNTIME_DIRECTORY systemd keeps what is in it from one start to the next. Who started it otherwise sees how it
/// ends.
int serve(const fs::path& path, ServiceSignals& signals) {
  const char* const folder = std::getenv("RUNTIME_DIRECTORY");
  auto safe_mode = device::SafeMode::begin(folder == nullptr ? "" : folder);
  const int code = serve(path, signals, safe_mode);
  safe_mode.end_in_order();
  return code;
}

struct PairOptions {
  int port = wire::kPairingPort;
  std::string name;
};

/// Lets one machine that a person knows by its code connect to the wire from now on, also while the daemon runs.
int pair(const fs::path& path, const PairOptions& options) {
  const auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  if (wire::is_loopback(config->wire.bind)) {
    print_error("birdseyed", fmt::format("pair: [wire] bind is {}, which no other machine reaches: set it to this "
                                         "machine's address on its network, or 0.0.0.0",
                                         config->wire.bind));
  }
  const auto folder = identity_folder();
  if (!folder) return refuse(folder.error());
  const auto paired = wire::pair_as_server({*folder, options.name, wire::ask_people}, config->wire.bind, options.port,
                                           Deadline::after(kPairingWindow), [&](int port) {
                                             fmt::print("for two minutes: birdseye pair THIS_MACHINE:{}\n", port);
                                             std::fflush(stdout);
                                           });
  if (!paired) return refuse(paired.error().with_context("pair"));
  print_line(fmt::format("paired with {}, in {}", paired->name, folder->string()));
  return 0;
}

int replay(const fs::path& path, const fs::path& recording, bool accept_unsigned, const ServiceSignals& signals) {
  const auto config = device::read_config(path);
  if (!config) return refuse(config.error());
  const auto admitted = device::admit_replay(recording, accept_unsigned);
  if (!admitted) return refuse(admitted.error());
  auto admission = device::admission_of(config->wire);
  if (!admission) return refuse(admission.error());
  const auto server = wire::Server::listen(config->wire.bind, config->wire.port, *std::move(admission));
  if (!server) return refuse(server.error());
  spdlog::info("replaying on {} port {}", config->wire.bind, (*server)->port());
  const auto done = device::replay(recording, *admitted, **server, signals.stop());
  return done ? 0 : refuse(done.error());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"birdseyed: tracker and camera of a laparoscope cart, on one clock, over OpenIGTLink", "birdseyed"};
  fs::path config_path, recording;
  app.set_version_flag("--version", "birdseyed " BIRDSEYE_VERSION);
  bool check_only = false, probe_only = false, end_with_stdin = false, accept_unsigned = false;
  app.add_option("--config", config_path, "configuration file (TOML)")->required();
  CLI::Option* const check =
      app.add_flag("--check", check_only, "say whether a start would take the configuration, and end");
  CLI::Option* const probe =
      app.add_flag("--probe", probe_only, "open each instrument once, say what it is or what is wrong, and end")
          ->excludes(check);
  CLI::Option* const replayed =
      app.add_option("--replay", recording, "an appliance recording, to be published in place of instruments")
          ->excludes(check)
          ->excludes(probe);
  app.add_flag("--accept-unsigned", accept_unsigned,
               "replay a recording also where it is not signed, or signed by a machine that is not known here")
      ->needs(replayed);
  app.add_flag("--end-with-stdin", end_with_stdin,
               "end when standard input is closed: for a program that starts this one");
  PairOptions pair_options;
  CLI::App* const pairing =
      app.add_subcommand("pair", "introduce this machine and a host by a code that people compare");
  pairing->fallthrough();  // to --config
  pairing->footer("Needs --config FILE too, whose [wire] bind is the address to wait on.");
  pairing->add_option("--port", pair_options.port, "to wait on (default 18945)")->check(CLI::Range(0, 65535));
  pairing->add_option("--name", pair_options.name, "by which to know the host (default: as it calls itself)");
  return run_program<CLI::ParseError>(app, argc, argv, [&] {
    if (*pairing) return pair(config_path, pair_options);
    if (check_only) return check_start(config_path);
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("birdseyed", std::make_shared<device::PatientStderr>()));
    ServiceSignals signals;
    const OwnedThread watch = end_with_stdin ? end_with_standard_input() : OwnedThread();
    if (probe_only) {
      const auto config = device::read_config(config_path);
      if (!config) return refuse(config.error());
      const auto faults = device::probe(*config, signals.stop());
      return faults ? 0 : refuse(faults.error());
    }
    return recording.empty() ? serve(config_path, signals) : replay(config_path, recording, accept_unsigned, signals);
  });
}
