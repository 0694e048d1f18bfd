#pragma once

#include <fmt/format.h>
#include <isa-l/crc64.h>

#include <cstdint>
#include <string>

namespace birdseye::calibration {

/// The checksum of what a JSON file says: CRC-64 of ECMA-182 over its text without white space, so that the file may be
/// laid out anew but not changed.
template <typename Json>
std::string checksum_of(const Json& json) {
  const std::string text = json.dump();
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  return fmt::format("crc64-ecma:{:016x}", ::crc64_ecma_norm(0, bytes, text.size()));
}

}  // namespace birdseye::calibration
