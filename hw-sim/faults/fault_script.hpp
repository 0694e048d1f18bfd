#pragma once

#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// The faults of a file, for each instrument in the order of their times.
struct FaultScript {
  std::vector<Fault> tracker, camera;
};

/// Which instruments there are for a script's faults to befall.
enum class Instruments { tracker, camera, both };

/// Reads a script (TOML, docs/manual/simulated-minibird.md). seed: what times drawn at random follow from, unless the
/// script has a seed of its own. The error tells everything that is wrong with the file, each with its line.
Result<FaultScript> read_fault_script(const std::filesystem::path& path, Instruments instruments, std::uint64_t seed);

}  // namespace birdseye::hw_sim
