#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/fault_judge.hpp"

namespace birdseye::testing {

/// Faults of the appliance's surroundings: clients, configuration, disk, instruments that are absent or something else.
/// Each has a birdseyed of its own in the folder.
struct ApplianceFault {
  const char* name;
  const char* how;
  FaultRow (*befall)(const std::filesystem::path& folder, std::vector<std::string>& problems);
};
std::vector<ApplianceFault> appliance_faults();

}  // namespace birdseye::testing
