#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Many numbers as a text for JSON: little-endian, compressed by zlib, in base64. Reads back the same to the bit.
std::string packed_floats(std::span<const float> values);
/// Refuses what does not hold exactly so many numbers.
Result<std::vector<float>> unpacked_floats(const std::string& text, std::size_t count);

}  // namespace birdseye::host
