#include "host/bench/wire_study.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/system/interrupt.hpp"
#include "host/app/commands.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchWireOptions {
  std::filesystem::path json;
  WireStudyOptions study;
};

Result<void> bench_wire(const BenchWireOptions& options) {
  note_interrupts();
  const auto figures = wire_study(options.study);
  if (!figures) return figures.error();
  fmt::print("{}\n", figures->dump(2));
  return write_files({{options.json, text_of(*figures)}});
}

}  // namespace

void add_bench_wire(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchWireOptions>();
  CLI::App& wire = *bench.add_subcommand("wire", "1080p60 over the wire, plain and by TLS: processor time, losses");
  wire.add_option("--json", options->json, "write the figures to this file");
  wire.add_option("--seconds", options->study.seconds, "of each measurement (default 10)")
      ->check(CLI::Range(1.0, 3600.0));
  wire.add_option("--rounds", options->study.rounds, "of both ways in turn (default 3)")->check(CLI::Range(1, 100));
  wire.callback([options, &status] { status.take(bench_wire(*options)); });
}

}  // namespace birdseye::host
