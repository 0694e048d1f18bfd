#include "hw-sim/campaign/seed_runner.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <tbb/info.h>

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include "drivers/system/child_process.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr Duration kMargin = Duration::from_ms(60'000);  // for messages, and for the disk

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

/// What is wrong with how a seed's program ended; empty where its exit code is 0, or 3, which says that its verdict is
/// bad. An error where something else ended the program, as the kernel does where memory runs short: such a seed has no
/// result, and is tried again.
Result<std::string> fault_of_end(const std::optional<int>& code) {
  constexpr int kSignal = 128, kBadVerdict = 3;
  if (!code) return std::string("it did not end in time");
  if (*code == kSignal + SIGKILL || *code == kSignal + SIGTERM || *code == kSignal + SIGINT) {
    return Error{Errc::disconnected,
                 fmt::format("its program was ended by signal {}, as where memory is short", *code - kSignal)};
  }
  if (*code > kSignal) return fmt::format("its program crashed, with signal {}", *code - kSignal);
  return *code == 0 || *code == kBadVerdict ? std::string() : fmt::format("its program ended with {}", *code);
}

/// An error: nothing can be run at all.
Result<Outcome> run_one(const SeedStudy& study, const std::filesystem::path& log, std::uint64_t seed) {
  auto child = ChildProcess::start(command_for(study, seed), log, ChildProcess::Pipe::stdout_from_child,
                                   ChildProcess::Signals::with_us, ChildProcess::Life::ours);
  if (!child) return child.error();
  const Deadline deadline = Deadline::after(study.patience);
  const auto line = child->read_line(deadline);
  if (line && !*line) return Outcome{seed, study.kept(seed, Error{Errc::timeout, "none in time"})};
  const auto fault = fault_of_end(child->wait(deadline));
  if (!fault) return Outcome{seed, fault.error()};
  if (!line) {
    return Outcome{seed, study.kept(seed, Error{Errc::disconnected,
                                                fmt::format("none: {}; {} may say why",
                                                            fault->empty() ? "it ended" : *fault, log.string())})};
  }
  if (!fault->empty()) return Outcome{seed, study.kept(seed, Error{Errc::bad_value, *fault})};
  return Outcome{seed, study.kept(seed, **line)};
}

/// What several threads work off. What they bring goes to the disk together, and nobody waits for that.
class Work {
 public:
  Work(const SeedStudy& study, std::deque<std::uint64_t> seeds, std::optional<Deadline> until, SeedResults& results,
       const Said& said)
      : study_(study),
        seeds_(std::move(seeds)),
        all_(seeds_.size()),
        until_(until),
        results_(results),
        said_(said),
        entering_([this](const std::stop_token& stop) { enter(stop); }) {}

  std::optional<std::uint64_t> next() {
    const std::lock_guard lock(mutex_);
    if (seeds_.empty() || fault_ || (until_ && until_->passed())) return std::nullopt;
    const std::uint64_t seed = seeds_.front();
    seeds_.pop_front();
    return seed;
  }
  void take(Outcome outcome) {
    std::unique_lock lock(mutex_);
    constexpr std::size_t kMost = 10'000;
    if (!changed_.wait(lock, Deadline::after(kMargin), [this] { return brought_.size() < kMost; }))
      return fail_locked({Errc::timeout, "the disk takes no results; is it full, or its server gone?"});
    brought_.push_back(std::move(outcome));
    changed_.notify_all();
  }
  void fail(const Error& fault) {
    const std::lock_guard lock(mutex_);
    fail_locked(fault);
  }
  [[nodiscard]] std::optional<Error> fault() const {
    const std::lock_guard lock(mutex_);
    return fault_;
  }
  /// Once nothing more is taken: all is on the disk when this returns.
  [[nodiscard]] Result<void> complete() {
    entering_.request_stop();
    entering_.join();
    if (fault_) return *fault_;
    if (without_ == 0) return {};
    return Error{Errc::io, fmt::format("{} of {} seeds gave no result, as {}; started again, these are tried again",
                                       without_, all_, first_without_)};
  }

 private:
  /// In a thread of its own, until stop is requested and nothing waits.
  void enter(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !brought_.empty(); })) {
      const std::vector<Outcome> outcomes = std::exchange(brought_, {});
      changed_.notify_all();
      lock.unlock();
      std::vector<SeedLine> lines;
      for (const Outcome& one : outcomes) {
        if (one.line) lines.push_back({one.seed, *one.line});
      }
      const auto entered = results_.enter(lines);
      lock.lock();
      if (!entered) fail_locked(entered.error());
      count(outcomes);
    }
  }
  void count(const std::vector<Outcome>& outcomes) {
    const std::size_t before = done_;
    done_ += outcomes.size();
    for (const Outcome& one : outcomes) {
      if (one.line) {
        told_ += !study_.told.empty() && study_.tells(*one.line) ? 1 : 0;
      } else if (without_++ == 0) {
        first_without_ = fmt::format("seed {}: {}", one.seed, one.line.error().what);
      }
    }
    if (done_ / kTells == before / kTells && done_ != all_) return;
    said_(fmt::format("{} of {}{}{}", done_, all_,
                      study_.told.empty() ? "" : fmt::format(", {} {}", told_, study_.told),
                      without_ == 0 ? "" : fmt::format(", {} gave no result", without_)));
  }
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
  std::vector<Outcome> brought_;
  Condition changed_;
  OwnedThread entering_;  // last: it uses all of the above
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
        outcome ? work.take(*outcome) : work.fail(outcome.error());
      }
    });
  }
  return threads;
}

// Kinds of messages. To rank 0: ready for a first seed; the line of its seed, or why there is none. From rank 0: a
// seed; the end.
constexpr int kReady = 0, kLine = 1, kNone = 2, kSeed = 3, kEnd = 4;

/// What rank 0 does beside its own seeds, until no other rank has one.
Result<void> hand_out(Ranks& ranks, Duration patience, Work& work) {
  struct Other {
    std::uint64_t seed = 0;
    std::optional<Deadline> answers;  // empty: it has no seed, and waits for the end
  };
  std::vector<Other> others(static_cast<std::size_t>(ranks.size()));
  const auto within = [&] { return Deadline::after(patience + kMargin); };
  for (std::size_t i = 1; i < others.size(); ++i) others[i].answers = within();
  const auto busy = [](const Other& other) { return other.answers.has_value(); };
  while (std::ranges::any_of(others, busy)) {
    if (const auto message = ranks.receive(Deadline::after(Duration::from_ms(100)))) {
      Other& other = others[static_cast<std::size_t>(message->rank)];
      if (message->kind == kLine) work.take({other.seed, message->text});
      if (message->kind == kNone) work.take({other.seed, Error{Errc::disconnected, message->text}});
      other.answers.reset();
      if (const auto next = work.next()) {
        other = {*next, within()};
        ranks.send(message->rank, kSeed, fmt::format("{}", *next));
      }
    }
    if (const auto fault = work.fault()) return *fault;
    for (std::size_t i = 1; i < others.size(); ++i) {
      if (others[i].answers && others[i].answers->passed()) {
        return Error{Errc::timeout, fmt::format("rank {} has not answered; is its machine still there?", i)};
      }
    }
  }
  return {};
}

/// What the other ranks do.
Result<void> work_for_rank_0(Ranks& ranks, const SeedStudy& study, const std::filesystem::path& log) {
  ranks.send(0, kReady, "");
  for (;;) {
    // The last seed of another rank may have begun just now.
    const auto message = ranks.receive(Deadline::after(study.patience + kMargin + kMargin));
    if (!message) return Error{Errc::timeout, "rank 0 has not answered; is its machine still there?"};
    if (message->kind == kEnd) break;
    const auto outcome = run_one(study, log, std::stoull(message->text));
    if (!outcome) return outcome.error();
    outcome->line ? ranks.send(0, kLine, *outcome->line) : ranks.send(0, kNone, outcome->line.error().what);
  }
  ranks.leave();
  return {};
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (!failed) return {};
  return Error{Errc::io, fmt::format("{}: cannot be made ({}); check the path and its permissions", folder.string(),
                                     failed.message())};
}

Result<std::unique_ptr<SeedResults>> run_all(const SeedStudy& study, const SeedRun& run, const Said& said,
                                             Ranks* ranks) {
  if (auto made = make_folder(run.folder); !made) return made.error();
  if (ranks != nullptr && ranks->rank() > 0) {
    const auto log = run.folder / fmt::format("campaign-{}.log", ranks->rank());
    if (auto worked = work_for_rank_0(*ranks, study, log); !worked) return worked.error();
    return std::unique_ptr<SeedResults>();
  }
  if (ranks != nullptr && run.jobs > 0) {
    return Error{Errc::bad_value,
                 "--jobs is for a campaign without mpirun, whose -n says how many seeds run at a time"};
  }
  std::optional<Deadline> until;
  if (run.at_most_s) until = Deadline::after(Duration::from_seconds(*run.at_most_s));
  auto results = SeedResults::open(run.folder / study.file, study.what);
  if (!results) return results.error();
  auto seeds = missing(**results, run);
  if (!seeds) return seeds.error();
  Work work(study, *std::move(seeds), until, **results, said);
  const int jobs = run.jobs > 0 ? run.jobs : ranks != nullptr ? 1 : tbb::info::default_concurrency();
  auto threads = at_work(jobs, study, run.folder / "campaign.log", work);
  if (ranks != nullptr) {
    if (auto handed = hand_out(*ranks, study.patience, work); !handed) work.fail(handed.error());
  }
  for (OwnedThread& thread : threads) thread.join();
  if (ranks != nullptr && !work.fault()) {
    for (int other = 1; other < ranks->size(); ++other) ranks->send(other, kEnd, "");
    ranks->leave();
  }
  if (auto complete = work.complete(); !complete) return complete.error();
  return results;
}

}  // namespace

Result<std::unique_ptr<SeedResults>> run_seeds(const SeedStudy& study, const SeedRun& run, const Said& said,
                                               Ranks* ranks) {
  auto results = run_all(study, run, said, ranks);
  if (!results && ranks != nullptr && !ranks->left()) ranks->give_up(results.error());
  return results;
}

}  // namespace birdseye::hw_sim
