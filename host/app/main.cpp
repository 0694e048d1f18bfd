#include "drivers/system/number_options.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/confine/run_confined.hpp"

int main(int argc, char** argv) {
  using namespace birdseye::host;
  stand_by_to_confine();  // before there are threads
  CLI::App app{"birdseye: a registered, deformable CT over live laparoscopic video", "birdseye"};
  app.set_version_flag("--version", "birdseye " BIRDSEYE_VERSION);
  app.require_subcommand(1);
  CommandStatus status;
  add_bench(app, status);
  add_calibrate(app, status);
  add_convert(app, status);
  add_demo(app, status);
  add_doctor(app, status);
  add_export(app, status);
  add_live(app, status);
  add_pair(app, status);
  add_record(app, status);
  add_register(app, status);
  add_render(app, status);
  add_replay(app, status);
  add_verify(app, status);
  add_volume(app, status);
  refuse_outputs_over_inputs(app);
  birdseye::refuse_odd_numbers(app);
  return birdseye::run_program<CLI::ParseError>(app, argc, argv, [&status] { return static_cast<int>(status.code); });
}
