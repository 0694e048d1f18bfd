#include "host/app/calibrate_commands.hpp"

namespace birdseye::host {

void add_calibrate(CLI::App& app, CommandStatus& status) {
  CLI::App* calibrate = app.add_subcommand("calibrate", "lens, hand-eye, pointer tip, latency and the tracker's field");
  calibrate->require_subcommand(1);
  add_calibrate_camera(*calibrate, status);
  add_calibrate_tip(*calibrate, status);
  add_calibrate_hand_eye(*calibrate, status);
  add_calibrate_latency(*calibrate, status);
  add_calibrate_field(*calibrate, status);
  add_calibrate_record(*calibrate, status);
}

}  // namespace birdseye::host
