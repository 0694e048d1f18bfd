#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "drivers/system/thread.hpp"

namespace birdseye {

/// One piece of work at a time on a thread of its own, so that the window goes on meanwhile. Ends its thread with
/// itself.
template <typename T>
class Background {
 public:
  /// Says how far the work is, in a line that the next replaces.
  using Say = std::function<void(const std::string&)>;
  using Work = std::function<T(const std::stop_token&, const Say&)>;

  /// Not while it runs.
  void start(Work work) {
    thread_ = {};
    (void)take();  // what came of the work before is not of this
    running_ = true;
    say("");
    thread_ = OwnedThread([this, work = std::move(work)](const std::stop_token& stop) {
      T result = work(stop, [this](const std::string& line) { say(line); });
      const std::lock_guard lock(mutex_);
      result_ = std::move(result);
      running_ = false;
    });
  }
  [[nodiscard]] bool running() const { return running_; }
  void cancel() { thread_.request_stop(); }
  /// What came of it, once.
  std::optional<T> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(result_, std::nullopt);
  }
  [[nodiscard]] std::string line() const {
    const std::lock_guard lock(mutex_);
    return line_;
  }

 private:
  void say(const std::string& line) {
    const std::lock_guard lock(mutex_);
    line_ = line;
  }

  std::atomic<bool> running_ = false;
  mutable std::mutex mutex_;
  std::optional<T> result_;
  std::string line_;
  OwnedThread thread_;
};

}  // namespace birdseye
