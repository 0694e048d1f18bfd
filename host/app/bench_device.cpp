#include "host/bench/device_study.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/system/interrupt.hpp"
#include "host/app/commands.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchDeviceOptions {
  std::filesystem::path json;
  DeviceStudyOptions study;
};

Result<void> bench_device(const BenchDeviceOptions& options) {
  note_interrupts();
  const auto figures = device_study(options.study);
  if (!figures) return figures.error();
  fmt::print("{}\n", figures->dump(2));
  return write_files({{options.json, text_of(*figures)}});
}

}  // namespace

void add_bench_device(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchDeviceOptions>();
  CLI::App& device = *bench.add_subcommand("device", "birdseyed on simulated instruments: load, times, recovery");
  device.add_option("--json", options->json, "write the figures to this file");
  device.add_option("--seconds", options->study.seconds, "of the load (default 60)")->check(CLI::Range(10.0, 86'400.0));
  device.add_option("--clients", options->study.clients, "that take everything (default 2)")->check(CLI::Range(1, 8));
  device.callback([options, &status] { status.take(bench_device(*options)); });
}

}  // namespace birdseye::host
