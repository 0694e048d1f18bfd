#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/campaign/operation_results.hpp"
#include "hw-sim/campaign/seed_runner.hpp"

namespace birdseye::hw_sim {

struct StudiedOperations {
  double minutes = 10;
  bool pictures = false;  ///< the video shows what the scope sees
};

/// Simulated operations. One that crashes, or ends without a result, counts as one that broke a law.
/// program: it knows `operation --line`; results of another build of it are another study's. Fails where it cannot be
/// read.
Result<SeedStudy> study_of_operations(const StudiedOperations& operations, const std::string& program);

/// The fewest faults by which the operation of a seed still breaks the first law that it broke, as a script. An error
/// where the search takes longer than patience (Errc::timeout), or finds no script, as where the operation crashes. log
/// gets what the program writes to standard error.
Result<std::string> shortest_script_of(std::uint64_t seed, const StudiedOperations& operations,
                                       const std::string& program, const std::filesystem::path& log, Duration patience);

/// Any other study: the command prints one line of JSON for each seed.
SeedStudy study_of(const std::vector<std::string>& command, Duration patience);

}  // namespace birdseye::hw_sim
