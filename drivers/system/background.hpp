#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye {

/// One piece of work at a time on a thread of its own, so that the window goes on meanwhile. None of its calls waits
/// for work. Ends its thread with itself: asks the work to stop, and waits for it until a deadline. Work that hangs
/// beyond that is let go, so work must own all that it uses.
template <typename T>
class Background {
 public:
  /// Says how far the work is, in a line that the next replaces.
  using Say = std::function<void(const std::string&)>;
  using Work = std::function<T(const std::stop_token&, const Say&)>;

  static constexpr Duration kEndsWithin = Duration::from_ms(20'000);

  Background() = default;
  /// ends_within: from when its owner goes.
  explicit Background(Duration ends_within) : ends_within_(ends_within) {}
  ~Background() {
    cancel();
    {
      std::unique_lock lock(shared_->mutex);
      if (shared_->ended.wait(lock, Deadline::after(ends_within_), [this] { return !shared_->running; })) return;
    }
    thread_.let_go();
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Work that runs is asked to stop, and what comes of it is thrown away. This begins when that has ended.
  void start(Work work) {
    cancel();
    const std::lock_guard lock(shared_->mutex);
    shared_->next = std::move(work);
    shared_->stop = std::stop_source();
    shared_->result.reset();
    shared_->line.clear();
    if (shared_->running) return;
    thread_ = OwnedThread([shared = shared_](const std::stop_token&) { run(shared); });  // once the lock is free
    shared_->running = true;
  }
  [[nodiscard]] bool running() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->running;
  }
  void cancel() {
    const auto stop = [this] {
      const std::lock_guard lock(shared_->mutex);
      return shared_->stop;
    };
    stop().request_stop();  // what it calls may look here
  }
  /// What came of it, once.
  std::optional<T> take() {
    const std::lock_guard lock(shared_->mutex);
    return std::exchange(shared_->result, std::nullopt);
  }
  [[nodiscard]] std::string line() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->line;
  }

 private:
  struct Shared {
    std::mutex mutex;  // of what follows
    Condition ended;
    Work next;  ///< to be begun; replaces what runs
    std::stop_source stop;
    bool running = false;
    std::optional<T> result;
    std::string line;
  };

  static void run(const std::shared_ptr<Shared>& shared) {
    const Say say = [&shared](const std::string& line) {
      const std::lock_guard lock(shared->mutex);
      if (!shared->next) shared->line = line;
    };
    std::unique_lock lock(shared->mutex);
    while (shared->next) {
      Work work = std::exchange(shared->next, nullptr);
      const std::stop_token stop = shared->stop.get_token();
      lock.unlock();
      {
        T result = work(stop, say);
        work = nullptr;  // what it holds is gone before anybody hears that it has ended
        lock.lock();
        if (!shared->next) {
          shared->result.emplace(std::move(result));
          continue;
        }
        lock.unlock();  // to free a CT takes its time
      }
      lock.lock();
    }
    shared->running = false;
    shared->ended.notify_all();
  }

  Duration ends_within_ = kEndsWithin;
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  OwnedThread thread_;
};

}  // namespace birdseye
