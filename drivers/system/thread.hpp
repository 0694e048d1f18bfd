#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "drivers/system/condition.hpp"
#include "drivers/system/time_keeper.hpp"

namespace birdseye {

/// A thread with one owner, which is asked to stop and waited for when its owner goes.
class OwnedThread {
 public:
  OwnedThread() = default;
  /// work: called once, with the token by which it is asked to stop.
  template <typename Work>
  explicit OwnedThread(Work work) {
    if (TimeKeeper* const keeper = TimeKeeper::present()) {
      kept_ = std::make_unique<Kept>();
      kept_->thread = keeper->start(
          [work = std::make_shared<Work>(std::move(work)), stop = kept_->stop.get_token()] { (*work)(stop); });
    } else {
      thread_ = std::jthread(std::move(work));
    }
  }

  void request_stop() { kept_ ? void(kept_->stop.request_stop()) : void(thread_.request_stop()); }
  /// Waits until its work is done; at once where there is none.
  void join() {
    if (kept_ && kept_->thread) kept_->thread->join();
    if (thread_.joinable()) thread_.join();
  }
  /// Lets it go on without an owner, for work that hangs and shares nothing with whoever started it.
  void let_go() {
    if (kept_) kept_->thread.reset();
    if (thread_.joinable()) thread_.detach();
  }

 private:
  /// In a simulator's time. Ends as a std::jthread does.
  struct Kept {
    Kept() = default;
    ~Kept() {
      if (!thread) return;
      stop.request_stop();
      thread->join();
    }
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;
    std::shared_ptr<TimeKeeper::Thread> thread;
    std::stop_source stop;
  };

  std::jthread thread_;
  std::unique_ptr<Kept> kept_;
};

/// Puts the calling thread before all that are not real-time. False without the right to it: nothing has changed then.
bool schedule_this_thread_real_time();

/// What work gives, or nothing where it has not by the deadline: it then goes on in a thread of its own, and what it
/// gives is thrown away. So work must own all that it uses.
template <typename T, typename Work>
std::optional<T> given_by(Deadline deadline, Work work) {
  struct Shared {
    std::mutex mutex;
    Condition given;
    std::optional<T> value;
  };
  auto shared = std::make_shared<Shared>();
  OwnedThread([shared, work = std::move(work)](const std::stop_token&) mutable {
    T value = work();
    const std::lock_guard lock(shared->mutex);
    shared->value = std::move(value);
    shared->given.notify_all();
  }).let_go();
  std::unique_lock lock(shared->mutex);
  shared->given.wait(lock, deadline, [&] { return shared->value.has_value(); });
  return std::exchange(shared->value, std::nullopt);
}

}  // namespace birdseye
