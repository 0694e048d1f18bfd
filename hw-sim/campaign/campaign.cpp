#include "hw-sim/campaign/campaign.hpp"

#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/system/child_process.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::hw_sim {

namespace {

/// For the slowest operation: a hundredth of its time is usual.
Duration patience_of(double minutes) {
  return Duration::from_seconds(std::max(60.0, 60 * minutes));
}

/// An operation that gives no result breaks a law too.
OperationResult ended(const CampaignSettings& settings, std::uint64_t seed, const std::string& how) {
  OperationResult out;
  out.seed = seed;
  out.minutes = settings.minutes;
  out.laws_broken = 1;
  out.broken = "result: " + how;
  return out;
}

Result<OperationResult> run_one(const CampaignSettings& settings, std::uint64_t seed) {
  auto child = ChildProcess::start({settings.program, "--end-with-stdin", "operation", "--line", "--seed",
                                    fmt::format("{}", seed), "--minutes", fmt::format("{}", settings.minutes)},
                                   settings.folder / "campaign.log", ChildProcess::Pipe::stdout_from_child,
                                   ChildProcess::Signals::with_us, ChildProcess::Life::ours);
  if (!child) return child.error();
  const Deadline deadline = Deadline::after(patience_of(settings.minutes));
  const auto line = child->read_line(deadline);
  if (!line) return ended(settings, seed, "none; " + (settings.folder / "campaign.log").string() + " says why");
  if (!*line) return ended(settings, seed, "none in time");
  auto result = result_of(**line);
  if (!result) return ended(settings, seed, result.error().what);
  (void)child->wait(deadline);
  return result;
}

/// What several threads work off.
class Work {
 public:
  Work(std::deque<std::uint64_t> seeds, std::optional<Deadline> until, OperationResults& results,
       const std::function<void(const std::string&)>& said)
      : seeds_(std::move(seeds)), all_(seeds_.size()), until_(until), results_(results), said_(said) {}

  std::optional<std::uint64_t> next() {
    const std::lock_guard lock(mutex_);
    if (seeds_.empty() || fault_ || (until_ && until_->passed())) return std::nullopt;
    const std::uint64_t seed = seeds_.front();
    seeds_.pop_front();
    return seed;
  }
  void take(const Result<OperationResult>& result) {
    const std::lock_guard lock(mutex_);
    const Result<void> entered = result ? results_.enter(*result) : Result<void>(result.error());
    if (!entered) {
      if (!fault_) fault_ = entered.error();
      return;
    }
    broken_ += result->laws_broken > 0 ? 1 : 0;
    if (++done_ % kTells == 0 || done_ == all_) said_(fmt::format("{} of {}, {} broke a law", done_, all_, broken_));
  }
  [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }

 private:
  static constexpr std::size_t kTells = 20;
  std::mutex mutex_;  // of what follows
  std::deque<std::uint64_t> seeds_;
  std::size_t all_, done_ = 0, broken_ = 0;
  std::optional<Deadline> until_;
  OperationResults& results_;
  const std::function<void(const std::string&)>& said_;
  std::optional<Error> fault_;
};

}  // namespace

Result<OperationResult> run_campaign(const CampaignSettings& settings,
                                     const std::function<void(const std::string&)>& said) {
  std::error_code failed;
  std::filesystem::create_directories(settings.folder, failed);
  if (failed) {
    return Error{Errc::io, fmt::format("{}: cannot be made ({}); check the path and its permissions",
                                       settings.folder.string(), failed.message())};
  }
  auto results = OperationResults::open(settings.folder / "operations.sqlite", settings.minutes);
  if (!results) return results.error();
  const auto known = (*results)->seeds();
  if (!known) return known.error();
  std::deque<std::uint64_t> missing;
  for (std::uint64_t seed = settings.first_seed; seed <= settings.last_seed; ++seed) {
    if (!known->contains(seed)) missing.push_back(seed);
  }
  std::optional<Deadline> until;
  if (settings.at_most_s) until = Deadline::after(Duration::from_seconds(*settings.at_most_s));
  Work work(std::move(missing), until, **results, said);
  {
    std::vector<OwnedThread> threads;
    const int jobs = settings.jobs > 0 ? settings.jobs : tbb::info::default_concurrency();
    threads.reserve(static_cast<std::size_t>(jobs));
    for (int i = 0; i < jobs; ++i) {
      threads.emplace_back([&](const std::stop_token&) {
        while (const auto seed = work.next()) work.take(run_one(settings, *seed));
      });
    }
    for (OwnedThread& thread : threads) thread.join();
  }
  if (work.fault()) return *work.fault();
  return (*results)->sum(settings.first_seed, settings.last_seed);
}

}  // namespace birdseye::hw_sim
