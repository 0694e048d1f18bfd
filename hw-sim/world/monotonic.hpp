#pragma once

#include <cstdint>

namespace birdseye::hw_sim {

/// CLOCK_MONOTONIC, ns.
std::int64_t monotonic_ns();
void sleep_until_ns(std::int64_t time_ns);

}  // namespace birdseye::hw_sim
