#include <CLI/CLI.hpp>

#include "drivers/system/number_options.hpp"
#include "drivers/system/program.hpp"
#include "hw-sim/app/instruments.hpp"

int main(int argc, char** argv) {
  using namespace birdseye;
  CLI::App app{"the instruments of birdseye-sim", "vm_instruments"};
  app.require_subcommand(1);
  int code = 0;
  const auto take = [&](const Result<void>& outcome) {
    if (outcome) return;
    print_error("vm_instruments", outcome.error().what);
    code = 2;
  };
  hw_sim::add_minibird_command(app, take);
  hw_sim::add_camera_command(app, take);
  refuse_odd_numbers(app);
  return run_program<CLI::ParseError>(app, argc, argv, [&code] { return code; });
}
