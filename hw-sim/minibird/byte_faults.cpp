#include "hw-sim/minibird/byte_faults.hpp"

#include <array>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

using Bytes = std::vector<std::uint8_t>;

/// One of the bytes without bit 7, each as likely; the first where there is none.
std::size_t unphased_byte(const Bytes& bytes, std::uint64_t draw) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if ((bytes[i] & 0x80U) == 0) places.push_back(i);
  }
  return places.empty() ? 0 : places[draw % places.size()];
}

}  // namespace

Bytes disturbed(FaultKind kind, std::span<const std::uint8_t> bytes, std::uint64_t seed, std::uint64_t key) {
  Bytes out(bytes.begin(), bytes.end());
  if (out.empty()) return out;
  const std::uint64_t draw = hashed_word(seed + 111, key);
  const std::size_t place = draw % out.size();
  const auto at = out.begin() + static_cast<std::ptrdiff_t>(place);
  switch (kind) {
    case FaultKind::drop_byte:
      out.erase(at);
      break;
    case FaultKind::duplicate_byte:
      out.insert(at, out[place]);
      break;
    case FaultKind::corrupt_byte: {
      std::uint8_t& byte = out[unphased_byte(out, draw)];
      byte = static_cast<std::uint8_t>(byte ^ (1 + (draw >> 32U) % 127));
      break;
    }
    case FaultKind::wrong_phase_bit:
      out[place] = static_cast<std::uint8_t>(out[place] ^ 0x80U);
      break;
    case FaultKind::line_noise: {
      Bytes noise(1 + (draw >> 32U) % 8);
      for (std::size_t i = 0; i < noise.size(); ++i) {
        noise[i] = static_cast<std::uint8_t>(hashed_word(seed + 112, key * 8 + i) & 0xFFU);
      }
      out.insert(at, noise.begin(), noise.end());
      break;
    }
    default:
      break;
  }
  return out;
}

}  // namespace birdseye::hw_sim
