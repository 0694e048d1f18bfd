#pragma once

#include <cstdint>

namespace birdseye::hw_sim {

/// One step of the generator SplitMix64: a well-mixed word from any word.
constexpr std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

/// A well-mixed word from a key: the same on every machine and in any order of evaluation.
constexpr std::uint64_t hashed_word(std::uint64_t seed, std::uint64_t key) {
  return splitmix64(splitmix64(seed) ^ key);
}

/// Likewise a number in [0, 1).
constexpr double hashed_uniform(std::uint64_t seed, std::uint64_t key) {
  return static_cast<double>(hashed_word(seed, key) >> 11U) * 0x1.0p-53;
}

/// Likewise near-normal, mean 0, standard deviation 1 (sum of twelve uniforms).
constexpr double hashed_normal(std::uint64_t seed, std::uint64_t key) {
  double sum = 0;
  const std::uint64_t base = hashed_word(seed, key);
  for (std::uint64_t i = 0; i < 4; ++i) {
    const std::uint64_t word = splitmix64(base + i);
    for (unsigned shift = 0; shift < 63; shift += 21) {
      sum += static_cast<double>((word >> shift) & 0x1FFFFFU) / static_cast<double>(0x200000U);
    }
  }
  return sum - 6.0;
}

}  // namespace birdseye::hw_sim
