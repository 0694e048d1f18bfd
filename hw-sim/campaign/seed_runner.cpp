#include "hw-sim/campaign/seed_runner.hpp"

#include <fmt/format.h>
#include <tbb/info.h>

#include <deque>
#include <mutex>
#include <utility>

#include "drivers/system/child_process.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::hw_sim {

namespace {

/// What came of a seed: the line to keep, or why there is none.
struct Outcome {
  std::uint64_t seed = 0;
  Result<std::string> line;
};

std::vector<std::string> command_for(const SeedStudy& study, std::uint64_t seed) {
  std::vector<std::string> out = study.command;
  const std::string number = fmt::format("{}", seed);
  constexpr std::string_view kPlace = "{}";
  for (std::string& word : out) {
    for (auto at = word.find(kPlace); at != std::string::npos; at = word.find(kPlace, at + number.size()))
      word.replace(at, kPlace.size(), number);
  }
  return out;
}

/// An error: nothing can be run at all.
Result<Outcome> run_one(const SeedStudy& study, const std::filesystem::path& log, std::uint64_t seed) {
  auto child = ChildProcess::start(command_for(study, seed), log, ChildProcess::Pipe::stdout_from_child,
                                   ChildProcess::Signals::with_us, ChildProcess::Life::ours);
  if (!child) return child.error();
  const Deadline deadline = Deadline::after(study.patience);
  const auto line = child->read_line(deadline);
  if (!line) {
    return Outcome{seed, study.kept(seed, Error{Errc::disconnected, fmt::format("none; {} says why", log.string())})};
  }
  if (!*line) return Outcome{seed, study.kept(seed, Error{Errc::timeout, "none in time"})};
  (void)child->wait(deadline);
  return Outcome{seed, study.kept(seed, **line)};
}

/// What several threads work off.
class Work {
 public:
  Work(const SeedStudy& study, std::deque<std::uint64_t> seeds, std::optional<Deadline> until, SeedResults& results,
       const Said& said)
      : study_(study), seeds_(std::move(seeds)), all_(seeds_.size()), until_(until), results_(results), said_(said) {}

  std::optional<std::uint64_t> next() {
    const std::lock_guard lock(mutex_);
    if (seeds_.empty() || fault_ || (until_ && until_->passed())) return std::nullopt;
    const std::uint64_t seed = seeds_.front();
    seeds_.pop_front();
    return seed;
  }
  void take(const std::vector<Outcome>& outcomes) {
    const std::lock_guard lock(mutex_);
    const std::size_t before = done_;
    std::vector<SeedLine> lines;
    for (const Outcome& one : outcomes) {
      ++done_;
      if (one.line) {
        lines.push_back({one.seed, *one.line});
        told_ += !study_.told.empty() && study_.tells(*one.line) ? 1 : 0;
      } else if (without_++ == 0) {
        first_without_ = fmt::format("seed {}: {}", one.seed, one.line.error().what);
      }
    }
    if (auto entered = results_.enter(lines); !entered) fail_locked(entered.error());
    if (done_ / kTells == before / kTells && done_ != all_) return;
    said_(fmt::format("{} of {}{}{}", done_, all_,
                      study_.told.empty() ? "" : fmt::format(", {} {}", told_, study_.told),
                      without_ == 0 ? "" : fmt::format(", {} gave no result", without_)));
  }
  void fail(const Error& fault) {
    const std::lock_guard lock(mutex_);
    fail_locked(fault);
  }
  [[nodiscard]] std::optional<Error> fault() const {
    const std::lock_guard lock(mutex_);
    return fault_;
  }
  /// Once all is done.
  [[nodiscard]] Result<void> complete() const {
    if (fault_) return *fault_;
    if (without_ == 0) return {};
    return Error{Errc::io, fmt::format("{} of {} seeds gave no result, as {}; started again, these are tried again",
                                       without_, all_, first_without_)};
  }

 private:
  void fail_locked(const Error& fault) {
    if (!fault_) fault_ = fault;
  }

  static constexpr std::size_t kTells = 20;
  mutable std::mutex mutex_;  // of what follows
  const SeedStudy& study_;
  std::deque<std::uint64_t> seeds_;
  std::size_t all_, done_ = 0, told_ = 0, without_ = 0;
  std::string first_without_;
  std::optional<Deadline> until_;
  SeedResults& results_;
  const Said& said_;
  std::optional<Error> fault_;
};

/// The missing ones.
Result<std::deque<std::uint64_t>> missing(const SeedResults& results, const SeedRun& run) {
  const auto known = results.seeds();
  if (!known) return known.error();
  std::deque<std::uint64_t> out;
  for (std::uint64_t seed = run.first_seed; seed <= run.last_seed; ++seed) {
    if (!known->contains(seed)) out.push_back(seed);
  }
  return out;
}

/// So many threads work, each on one seed at a time.
std::vector<OwnedThread> at_work(int jobs, const SeedStudy& study, const std::filesystem::path& log, Work& work) {
  std::vector<OwnedThread> threads;
  threads.reserve(static_cast<std::size_t>(jobs));
  for (int i = 0; i < jobs; ++i) {
    threads.emplace_back([&study, log, &work](const std::stop_token&) {
      while (const auto seed = work.next()) {
        const auto outcome = run_one(study, log, *seed);
        outcome ? work.take({*outcome}) : work.fail(outcome.error());
      }
    });
  }
  return threads;
}

}  // namespace

Result<std::unique_ptr<SeedResults>> run_seeds(const SeedStudy& study, const SeedRun& run, const Said& said) {
  std::error_code failed;
  std::filesystem::create_directories(run.folder, failed);
  if (failed) {
    return Error{Errc::io, fmt::format("{}: cannot be made ({}); check the path and its permissions",
                                       run.folder.string(), failed.message())};
  }
  std::optional<Deadline> until;
  if (run.at_most_s) until = Deadline::after(Duration::from_seconds(*run.at_most_s));
  auto results = SeedResults::open(run.folder / study.file, study.what);
  if (!results) return results.error();
  auto seeds = missing(**results, run);
  if (!seeds) return seeds.error();
  Work work(study, *std::move(seeds), until, **results, said);
  const int jobs = run.jobs > 0 ? run.jobs : tbb::info::default_concurrency();
  for (OwnedThread& thread : at_work(jobs, study, run.folder / "campaign.log", work)) thread.join();
  if (auto complete = work.complete(); !complete) return complete.error();
  return results;
}

}  // namespace birdseye::hw_sim
