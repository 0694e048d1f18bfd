#pragma once

#include "host/app/commands.hpp"

namespace birdseye::host {

// Under `calibrate`, one file each.
void add_calibrate_camera(CLI::App& calibrate, CommandStatus& status);
void add_calibrate_field(CLI::App& calibrate, CommandStatus& status);
void add_calibrate_hand_eye(CLI::App& calibrate, CommandStatus& status);
void add_calibrate_latency(CLI::App& calibrate, CommandStatus& status);
void add_calibrate_record(CLI::App& calibrate, CommandStatus& status);
void add_calibrate_tip(CLI::App& calibrate, CommandStatus& status);

}  // namespace birdseye::host
