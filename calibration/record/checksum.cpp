#include "calibration/record/checksum.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "calibration/base/crc64.hpp"
#include "calibration/record/sha256.hpp"

namespace birdseye::calibration {

std::string checksum_of(const std::string& json_text) {
  return "sha256:" + sha256_of(json_text);
}

bool has_checksum(const std::string& json_text, const std::string& checksum) {
  if (!checksum.starts_with("crc64-ecma:")) return checksum == checksum_of(json_text);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(json_text.data());
  return checksum == fmt::format("crc64-ecma:{:016x}", crc64_ecma({bytes, json_text.size()}));
}

}  // namespace birdseye::calibration
