#pragma once

#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// The faults of a file, for each instrument and for the operation in the order of their times.
struct FaultScript {
  std::vector<Fault> tracker, camera, world;
};

/// What a script's faults can befall: an instrument that runs alone, or a whole cart.
enum class Instruments { tracker, camera, both };

/// Reads a script (TOML, docs/manual/simulated-minibird.md). Times drawn at random follow from seed, unless the script
/// has one of its own. The error tells everything that is wrong with the file, with line numbers.
Result<FaultScript> read_fault_script(const std::filesystem::path& path, Instruments instruments, std::uint64_t seed);

}  // namespace birdseye::hw_sim
