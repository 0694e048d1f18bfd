#pragma once

#include <CLI/CLI.hpp>

#include "hw-sim/app/instruments.hpp"

namespace birdseye::hw_sim {

/// `operation`: one operation in virtual time. broken: set where a law did not hold.
void add_operation_command(CLI::App& app, const Take& take, bool& broken);

}  // namespace birdseye::hw_sim
