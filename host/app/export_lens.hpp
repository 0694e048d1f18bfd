#pragma once

#include "host/app/commands.hpp"

namespace birdseye::host {

/// Adds `lens` under `export`.
CLI::App* add_export_lens(CLI::App& parent, CommandStatus& status);

}  // namespace birdseye::host
