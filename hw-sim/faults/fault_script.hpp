#pragma once

#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// The faults of a file, for each instrument, for the operation and for its programs in the order of their times.
struct FaultScript {
  std::vector<Fault> tracker, camera, world, programs;

  [[nodiscard]] std::vector<Fault>& of(FaultTarget target);
  [[nodiscard]] const std::vector<Fault>& of(FaultTarget target) const;
};

/// What a script's faults can befall: an instrument that runs alone, a whole cart, or a cart whose programs the
/// simulator runs too.
enum class Instruments { tracker, camera, both, with_programs };

/// Reads a script (TOML, docs/manual/simulated-minibird.md). Times drawn at random follow from seed, unless the script
/// has one of its own. The error tells everything that is wrong with the file, with line numbers.
Result<FaultScript> read_fault_script(const std::filesystem::path& path, Instruments instruments, std::uint64_t seed);

}  // namespace birdseye::hw_sim
