#pragma once

#include <signal.h>

#include <atomic>
#include <stop_token>

#include "drivers/system/thread.hpp"

namespace birdseye {

/// The signals of a service: SIGTERM and SIGINT stop it, SIGHUP has it read its configuration again. They are taken by
/// one thread alone, and by waiting for them: no handler, nothing interrupted. To be made before any other thread is,
/// so that all inherit the mask.
class ServiceSignals {
 public:
  ServiceSignals();

  [[nodiscard]] std::stop_token stop() const { return stop_.get_token(); }
  /// Whether a SIGHUP came since it was last asked.
  bool take_reload() { return reload_.exchange(false); }

 private:
  void watch(const std::stop_token& done);

  sigset_t awaited_{};
  std::atomic<bool> reload_ = false;
  std::stop_source stop_;
  OwnedThread watcher_;
};

}  // namespace birdseye
