#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// The bytes of one measurement after a bad line. All draws follow from the key alone. kind: drop_byte, duplicate_byte,
/// corrupt_byte (a byte without bit 7 becomes another without it), wrong_phase_bit (bit 7 of one byte turned over) or
/// line_noise (1 to 8 random bytes pushed in somewhere).
std::vector<std::uint8_t> disturbed(FaultKind kind, std::span<const std::uint8_t> bytes, std::uint64_t seed,
                                    std::uint64_t key);

}  // namespace birdseye::hw_sim
