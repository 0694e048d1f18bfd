#pragma once

#include <span>
#include <string_view>

#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// What a fault does whose script does not say for how long.
enum class WithoutEnd { once, for_good, refused };

struct ParameterSpec {
  std::string_view name;
  double usual, low, high;
  bool whole = false;  ///< a whole number
};

/// What a script may say of a kind of fault.
struct FaultSpec {
  FaultKind kind;
  bool of_tracker, of_camera;
  WithoutEnd without_end;
  std::span<const ParameterSpec> parameters;
};

std::span<const FaultSpec> fault_table();
/// Null for a name that there is not.
const FaultSpec* fault_spec(std::string_view name);

}  // namespace birdseye::hw_sim
