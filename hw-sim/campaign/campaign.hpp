#pragma once

#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/campaign/operation_results.hpp"
#include "hw-sim/campaign/seed_runner.hpp"

namespace birdseye::hw_sim {

/// Simulated operations of so many minutes. One that ends without a result counts as one that broke a law.
/// program: it knows `operation --line`.
SeedStudy study_of_operations(double minutes, const std::string& program);

/// Any other study: the command prints one line of JSON for each seed.
SeedStudy study_of(const std::vector<std::string>& command, Duration patience);

}  // namespace birdseye::hw_sim
