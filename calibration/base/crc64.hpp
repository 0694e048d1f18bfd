#pragma once

#include <cstdint>
#include <span>

namespace birdseye {

/// CRC-64 of ECMA-182, inverted on the way in and out. seed: what the bytes before came to.
std::uint64_t crc64_ecma(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);

}  // namespace birdseye
