#pragma once

#include <span>
#include <string_view>

#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// How long a fault lasts whose script does not say so.
enum class WithoutEnd { once, for_good, refused };

struct ParameterSpec {
  std::string_view name;
  double usual, low, high;
  bool whole = false;  ///< a whole number
};

/// A kind of fault, and what a script may say of it.
struct FaultSpec {
  FaultKind kind;
  bool of_tracker, of_camera, of_world, of_program;
  WithoutEnd without_end;
  std::span<const ParameterSpec> parameters;
  double least_for_s = 1e-6;  ///< what is over sooner, nobody need see
};

std::span<const FaultSpec> fault_table();
/// The kind of fault with this name; null where there is none.
const FaultSpec* fault_spec(std::string_view name);

}  // namespace birdseye::hw_sim
