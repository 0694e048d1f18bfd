#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "drivers/system/thread.hpp"
#include "hw-sim/minibird/endpoint.hpp"
#include "hw-sim/minibird/tracker_script.hpp"

namespace birdseye::hw_sim {

/// A tracker in real time: a thread of its own runs a TrackerScript on CLOCK_MONOTONIC at an endpoint.
class TrackerLoop {
 public:
  /// Called from the loop's thread.
  struct Listeners {
    std::function<void(const FaultEvent&)> on_fault;
    std::function<void(double rate_hz)> on_rate;  ///< the true rate, at first and when it changes
    std::function<void(int count)> on_violation;  ///< the host examined parameters while records streamed
  };
  TrackerLoop(std::unique_ptr<Endpoint> endpoint, TrackerScript script, Listeners listeners);

  [[nodiscard]] bool streaming() const { return streaming_; }
  /// As TrackerScript::align. To be called before zero_ns has come.
  void align(std::int64_t zero_ns) { align_ns_ = zero_ns; }

 private:
  void run(const std::stop_token& stop);
  void follow_plug();
  void report();

  std::unique_ptr<Endpoint> endpoint_;
  TrackerScript script_;
  Listeners listeners_;
  bool plugged_ = true;
  double rate_hz_ = 0;
  int violations_ = 0;
  std::atomic<bool> streaming_ = false;
  std::atomic<std::int64_t> align_ns_ = 0;
  OwnedThread thread_;
};

}  // namespace birdseye::hw_sim
