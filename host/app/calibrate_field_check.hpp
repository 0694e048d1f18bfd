#pragma once

#include "host/app/commands.hpp"

namespace birdseye::host {

/// `check`, under `calibrate field`.
CLI::App* add_calibrate_field_check(CLI::App& field, CommandStatus& status);

}  // namespace birdseye::host
