#pragma once

#include <string>

namespace birdseye::testing {

/// In which order a parser sums over the keys of an object.
enum class Keys { sorted, as_written };

/// A JSON object with the checksum that fits it, as anybody can write one; any other text as it is.
std::string with_checksum(const std::string& text, Keys keys);

}  // namespace birdseye::testing
