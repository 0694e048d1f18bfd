#pragma once

#include <atomic>
#include <csignal>

namespace birdseye::hw_sim {

/// A flag that SIGTERM and SIGINT set from now on.
inline const std::atomic<bool>& stop_on_signal() {
  static std::atomic<bool> stop = false;
  std::signal(SIGTERM, [](int) { stop = true; });
  std::signal(SIGINT, [](int) { stop = true; });
  return stop;
}

}  // namespace birdseye::hw_sim
