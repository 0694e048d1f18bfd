#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hw-sim/minibird/unit.hpp"

namespace birdseye::hw_sim {

/// Gives it the bytes one by one: its reply.
inline std::vector<std::uint8_t> send(Unit& unit, const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> reply;
  for (const std::uint8_t byte : bytes) {
    const auto part = unit.receive(byte);
    reply.insert(reply.end(), part.begin(), part.end());
  }
  return reply;
}

/// The word that a record has at a place, by the rule of the reference and nothing of ours.
inline int signed_word_at(std::span<const std::uint8_t> record, std::size_t index) {
  const unsigned word = (record[2 * index] & 0x7FU) << 2U | (record[2 * index + 1] & 0x7FU) << 9U;
  return static_cast<std::int16_t>(word);
}

}  // namespace birdseye::hw_sim
