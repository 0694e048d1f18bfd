#pragma once

#include <functional>

#include "hw-sim/faults/fault_script.hpp"

namespace birdseye::hw_sim {

/// Of the faults of a script as few as still break what is asked: parts of it are left out, halves first, then single
/// faults, as long as it breaks without them (A. Zeller, R. Hildebrandt, Simplifying and Isolating Failure-Inducing
/// Input, 2002). What none can be left out of is not always the smallest there is.
FaultScript shortest_script(const FaultScript& script, const std::function<bool(const FaultScript&)>& breaks);

}  // namespace birdseye::hw_sim
