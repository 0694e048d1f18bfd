#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hw-sim/ftdi/ft232r.hpp"

namespace birdseye::hw_sim {

/// The chip's device, configuration and string descriptors, whole. Empty for a descriptor that the chip does not have.
std::optional<std::vector<std::uint8_t>> descriptor(std::uint8_t type, std::uint8_t index,
                                                    const Ft232rSettings& settings);

/// The words of its EEPROM: identity and strings, closed by their checksum.
std::array<std::uint16_t, 64> eeprom_of(const Ft232rSettings& settings);

}  // namespace birdseye::hw_sim
