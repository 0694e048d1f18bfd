#pragma once

#include <atomic>
#include <csignal>

namespace birdseye::hw_sim {

/// Set from now on by SIGTERM and SIGINT.
inline const std::atomic<bool>& stop_on_signal() {
  static std::atomic<bool> stop = false;
  std::signal(SIGTERM, [](int) { stop = true; });
  std::signal(SIGINT, [](int) { stop = true; });
  return stop;
}

}  // namespace birdseye::hw_sim
