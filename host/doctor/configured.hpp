#pragma once

#include <filesystem>
#include <vector>

#include "host/doctor/check.hpp"
#include "host/doctor/machine.hpp"

namespace birdseye::host {

/// Whether the instruments that a configuration of birdseyed names are at this machine. config: one that birdseyed
/// found sound. What would have to be opened or called to know is "not known".
std::vector<Check> check_configured(const Machine& machine, const std::filesystem::path& config);

}  // namespace birdseye::host
