#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "calibration/base/hex.hpp"
#include "calibration/base/result.hpp"

namespace birdseye {

/// What everybody may know of a machine's key: by it a signature is verified. Ed25519 (RFC 8032).
struct PublicKey {
  std::array<std::uint8_t, 32> bytes{};

  static Result<PublicKey> of_hex(std::string_view text);
  [[nodiscard]] std::string hex() const { return hex_of(bytes); }
  /// For people to compare: the first 16 bytes of its SHA-256, as "3f2a 9c01 ...".
  [[nodiscard]] std::string fingerprint() const;
  auto operator<=>(const PublicKey&) const = default;
};

using Signature = std::array<std::uint8_t, 64>;

/// Whether it is the signature of the key's machine over these bytes.
bool verify(const PublicKey& key, std::span<const std::uint8_t> bytes, const Signature& signature);

}  // namespace birdseye
