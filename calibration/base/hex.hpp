#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace birdseye {

/// Bytes as text: two digits each, lower case.
std::string hex_of(std::span<const std::uint8_t> bytes);
/// Into out: false, and out is not to be used, where the text is not two digits, of either case, for each of its bytes.
bool bytes_of_hex(std::string_view text, std::span<std::uint8_t> out);

}  // namespace birdseye
