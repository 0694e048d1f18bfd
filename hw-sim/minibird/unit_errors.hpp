#pragma once

#include <cstdint>

namespace birdseye::hw_sim {

/// The error codes of a unit, as its parameter ERROR tells them.
constexpr std::uint8_t kErrorInvalidCommand = 6, kErrorNotMaster = 7, kErrorNotInitialised = 9, kErrorNoResponse = 13,
                       kErrorTransmitter = 29;

}  // namespace birdseye::hw_sim
