#pragma once

#include <CLI/CLI.hpp>

#include "hw-sim/app/instruments.hpp"

namespace birdseye::hw_sim {

/// `campaign`: many operations in virtual time. broken: set where a law did not hold in one of them.
void add_campaign_command(CLI::App& app, const Take& take, bool& broken);

}  // namespace birdseye::hw_sim
