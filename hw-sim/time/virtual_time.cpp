#include "hw-sim/time/virtual_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/context/fiber.hpp>
#include <boost/context/protected_fixedsize_stack.hpp>
#include <cstddef>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

namespace birdseye::hw_sim {

namespace {

namespace context = boost::context;

constexpr std::size_t kStack = std::size_t{8} << 20;  // what a thread of the machine has; only what is used is there
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

struct Fiber {
  std::uint64_t id = 0;
  context::fiber here;  ///< where it goes on, while it does not run
  bool done = false;
};

class VirtualTime final : public TimeKeeper {
 public:
  explicit VirtualTime(const VirtualTimeSettings& settings)
      : settings_(settings), now_ns_(settings.begins_monotonic_ns), random_(settings.seed) {}

  Result<VirtualTimeFigures> run(std::function<void()> work);

  std::int64_t monotonic_ns() override {
    if (++reads_ > settings_.most_reads)
      throw std::logic_error(fmt::format("the clock was read {} times without a wait", settings_.most_reads));
    return now_ns_;
  }
  std::int64_t realtime_ns() override {
    return settings_.begins_realtime_ns + (monotonic_ns() - settings_.begins_monotonic_ns);
  }
  void sleep_until(std::int64_t monotonic_ns) override { wait(nullptr, monotonic_ns); }
  void wait_told(const void* thing, std::int64_t until_ns) override { wait(thing, until_ns); }
  void tell(const void* thing, bool all) override;
  std::shared_ptr<Thread> start(std::function<void()> work) override;
  void join(const std::shared_ptr<Fiber>& fiber) {
    while (!fiber->done) wait(fiber.get(), kNever);
  }

 private:
  struct Waiting {
    std::int64_t due_ns = kNever;
    const void* thing = nullptr;  ///< that it waits to be told of
    std::shared_ptr<Fiber> fiber;
    [[nodiscard]] bool before(const Waiting& other) const {
      return due_ns != other.due_ns ? due_ns < other.due_ns : fiber->id < other.fiber->id;
    }
  };

  std::shared_ptr<Fiber> make(std::function<void()> work);
  void wait(const void* thing, std::int64_t until_ns);
  void wake(std::vector<Waiting>::iterator one);
  bool advance();

  VirtualTimeSettings settings_;
  std::int64_t now_ns_;
  std::mt19937_64 random_;
  std::uint64_t reads_ = 0;
  VirtualTimeFigures figures_;
  context::fiber scheduler_;  ///< where it goes on, while a fiber runs
  std::shared_ptr<Fiber> running_;
  std::vector<std::shared_ptr<Fiber>> ready_;
  /// In the order in which they began to wait. It is searched at each switch: a program has a dozen threads, and trees
  /// and tables take longer.
  std::vector<Waiting> waiting_;
};

class VirtualThread final : public TimeKeeper::Thread {
 public:
  VirtualThread(VirtualTime& time, std::shared_ptr<Fiber> fiber) : time_(time), fiber_(std::move(fiber)) {}
  void join() override { time_.join(fiber_); }

 private:
  VirtualTime& time_;
  std::shared_ptr<Fiber> fiber_;
};

std::shared_ptr<Fiber> VirtualTime::make(std::function<void()> work) {
  auto fiber = std::make_shared<Fiber>();
  fiber->id = figures_.threads++;
  fiber->here = context::fiber(std::allocator_arg, context::protected_fixedsize_stack(kStack),
                               [this, work = std::move(work), one = fiber.get()](context::fiber&& scheduler) mutable {
                                 scheduler_ = std::move(scheduler);
                                 work();
                                 work = nullptr;  // what it holds is gone before anybody hears that it has ended
                                 one->done = true;
                                 tell(one, true);
                                 return std::move(scheduler_);
                               });
  ready_.push_back(fiber);
  return fiber;
}

std::shared_ptr<TimeKeeper::Thread> VirtualTime::start(std::function<void()> work) {
  return std::make_shared<VirtualThread>(*this, make(std::move(work)));
}

void VirtualTime::wait(const void* thing, std::int64_t until_ns) {
  reads_ = 0;
  waiting_.push_back({until_ns, thing, std::move(running_)});
  scheduler_ = std::move(scheduler_).resume();
}

void VirtualTime::wake(std::vector<Waiting>::iterator one) {
  ready_.push_back(std::move(one->fiber));
  waiting_.erase(one);
}

void VirtualTime::tell(const void* thing, bool all) {
  for (auto one = waiting_.begin(); one != waiting_.end();) {
    if (one->thing != thing) {
      ++one;
      continue;
    }
    const auto next = one - waiting_.begin();
    wake(one);
    if (!all) return;
    one = waiting_.begin() + next;
  }
}

/// To the next time that somebody waits for. False: nobody does.
bool VirtualTime::advance() {
  const auto before = [](const Waiting& a, const Waiting& b) { return a.before(b); };
  auto first = std::ranges::min_element(waiting_, before);
  if (first == waiting_.end() || first->due_ns == kNever) return false;
  now_ns_ = std::max(now_ns_, first->due_ns);
  while (first != waiting_.end() && first->due_ns <= now_ns_) {
    wake(first);
    first = std::ranges::min_element(waiting_, before);
  }
  return true;
}

Result<VirtualTimeFigures> VirtualTime::run(std::function<void()> work) {
  make(std::move(work));
  while (!ready_.empty() || advance()) {
    // A library's distribution differs from one to the next; the generator is the standard's.
    const std::size_t chosen = ready_.size() > 1 ? random_() % ready_.size() : 0;
    running_ = std::move(ready_[chosen]);
    ready_.erase(ready_.begin() + static_cast<std::ptrdiff_t>(chosen));
    reads_ = 0;
    ++figures_.switches;
    constexpr std::uint64_t kPrime = 1'099'511'628'211U;  // FNV-1a
    figures_.order_hash = (figures_.order_hash ^ running_->id ^ static_cast<std::uint64_t>(now_ns_)) * kPrime;
    Fiber& one = *running_;  // it is among those that wait once it comes back, or has ended and is still running_
    one.here = std::move(one.here).resume();
  }
  running_.reset();
  figures_.elapsed_ns = now_ns_ - settings_.begins_monotonic_ns;
  if (waiting_.empty()) return figures_;
  // To unwind their stacks would run destructors that wait for each other.
  for (const Waiting& one : waiting_) new context::fiber(std::move(one.fiber->here));
  return Error{Errc::timeout, fmt::format("{} threads wait for each other, at {:.3f} s", waiting_.size(),
                                          static_cast<double>(figures_.elapsed_ns) * 1e-9)};
}

}  // namespace

Result<VirtualTimeFigures> run_in_virtual_time(const VirtualTimeSettings& settings, std::function<void()> work) {
  VirtualTime time(settings);
  TimeKeeper::put(&time);
  auto ran = time.run(std::move(work));
  TimeKeeper::put(nullptr);
  return ran;
}

}  // namespace birdseye::hw_sim
