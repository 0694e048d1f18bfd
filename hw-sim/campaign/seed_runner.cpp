#include "hw-sim/campaign/seed_runner.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <tbb/info.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

#include "drivers/system/child_process.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/thread.hpp"
#include "hw-sim/campaign/children_folder.hpp"

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

/// Whether a program may have crashed because there was no room for its temporary files.
bool is_room_short() {
  constexpr std::uintmax_t kEnough_bytes = std::uintmax_t{1} << 20U;
  std::error_code failed;
  const auto room = std::filesystem::space(std::filesystem::temp_directory_path(failed), failed);
  return failed || room.available < kEnough_bytes;
}

/// What is wrong with how a seed's program ended; empty where its exit code is 0, or 3, which says that its verdict is
/// bad. An error where that says nothing of the seed: something else ended the program, as the kernel does where memory
/// runs short, or the program says that it could not be run. Such a seed has no result, and is tried again.
Result<std::string> fault_of_end(const std::optional<int>& code, const std::filesystem::path& log) {
  constexpr int kSignal = 128;
  constexpr int kUnusable = static_cast<int>(ExitCode::unusable_input);
  constexpr int kBadVerdict = static_cast<int>(ExitCode::verdict_fail);
  if (!code) return std::string("it did not end in time");
  if (*code == kUnusable) {
    return Error{Errc::unreadable,
                 fmt::format("its program could not be run, and ended with {}; {} says why", kUnusable, log.string())};
  }
  if (*code == kSignal + SIGKILL || *code == kSignal + SIGTERM || *code == kSignal + SIGINT) {
    return Error{Errc::disconnected,
                 fmt::format("its program was ended by signal {}, as where memory is short", *code - kSignal)};
  }
  if (*code > kSignal && is_room_short()) {
    return Error{Errc::io, fmt::format("its program crashed, with signal {}, where temporary files have no room; make "
                                       "room there, or set TMPDIR to a folder with room",
                                       *code - kSignal)};
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
  const auto fault = fault_of_end(child->wait(deadline), log);
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
  /// log: where to look why seeds give no result.
  Work(const SeedStudy& study, std::filesystem::path log, std::deque<std::uint64_t> seeds,
       std::optional<Deadline> until, SeedResults& results, const Said& said)
      : study_(study),
        log_(std::move(log)),
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
        without_in_row_ = 0;
      } else {
        count_without(one.seed, one.line.error());
      }
    }
    if (done_ / kTells == before / kTells && done_ != all_) return;
    said_(fmt::format("{} of {}{}{}", done_, all_,
                      study_.told.empty() ? "" : fmt::format(", {} {}", told_, study_.told),
                      without_ == 0 ? "" : fmt::format(", {} gave no result", without_)));
  }
  void count_without(std::uint64_t seed, const Error& why) {
    constexpr std::size_t kMostInRow = 10;
    const std::string words = fmt::format("seed {}: {}", seed, why.what);
    if (without_++ == 0) first_without_ = words;
    if (++without_in_row_ < kMostInRow) return;
    fail_locked({why.code, fmt::format("{} seeds in a row gave no result, the last as {} ({} has what programs said); "
                                       "mend that, and start the campaign again: it tries these seeds again",
                                       kMostInRow, words, log_.string())});
  }
  void fail_locked(const Error& fault) {
    if (!fault_) fault_ = fault;
  }

  static constexpr std::size_t kTells = 20;
  mutable std::mutex mutex_;  // of what follows
  const SeedStudy& study_;
  std::filesystem::path log_;
  std::deque<std::uint64_t> seeds_;
  std::size_t all_, done_ = 0, told_ = 0, without_ = 0, without_in_row_ = 0;
  std::string first_without_;
  std::optional<Deadline> until_;
  SeedResults& results_;
  const Said& said_;
  std::optional<Error> fault_;
  std::vector<Outcome> brought_;
  Condition changed_;
  OwnedThread entering_;  // last: it uses all of the above
};

/// The missing ones: first those beyond all that are known, then the gaps, whose seeds may have given no result before
/// and stop a campaign that comes to ten of them.
Result<std::deque<std::uint64_t>> missing(const SeedResults& results, const SeedRun& run) {
  const auto known = results.seeds();
  if (!known) return known.error();
  std::deque<std::uint64_t> out;
  for (std::uint64_t seed = run.first_seed; seed <= run.last_seed; ++seed) {
    if (!known->contains(seed)) out.push_back(seed);
  }
  if (!known->empty()) std::rotate(out.begin(), std::upper_bound(out.begin(), out.end(), *known->rbegin()), out.end());
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

// Kinds of messages. To rank 0: ready for a first seed, with what the rank would run; the line of its seed, or why
// there is none. From rank 0: a seed; the end.
constexpr int kReady = 0, kLine = 1, kNone = 2, kSeed = 3, kEnd = 4;

/// What a rank runs, which has to be the same in all ranks.
std::string words_of(const SeedStudy& study, const SeedRun& run) {
  return fmt::format("seeds {} to {} of {}", run.first_seed, run.last_seed, study.what);
}

/// What rank 0 does beside its own seeds, until no other rank has one. ours: what rank 0 runs.
Result<void> hand_out(Ranks& ranks, Duration patience, const std::string& ours, Work& work) {
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
      if (message->kind == kReady && message->text != ours) {
        return Error{Errc::bad_value,
                     fmt::format("rank {} would run {}, where rank 0 runs {}; start all ranks by one command, with the "
                                 "same birdseye-sim on each machine",
                                 message->rank, message->text, ours)};
      }
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
Result<void> work_for_rank_0(Ranks& ranks, const SeedStudy& study, const SeedRun& run) {
  const auto log = run.folder / fmt::format("campaign-{}.log", ranks.rank());
  ranks.send(0, kReady, words_of(study, run));
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

Result<SeedsDone> run_all(const SeedStudy& study, const SeedRun& run, const Said& said, Ranks* ranks) {
  if (auto made = make_folder(run.folder); !made) return made.error();
  const auto temporary = ChildrenFolder::make();
  if (!temporary) return temporary.error();
  if (ranks != nullptr && ranks->rank() > 0) {
    if (auto worked = work_for_rank_0(*ranks, study, run); !worked) return worked.error();
    return SeedsDone{};
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
  const auto log = run.folder / "campaign.log";
  Work work(study, log, *std::move(seeds), until, **results, said);
  const int jobs = run.jobs > 0 ? run.jobs : ranks != nullptr ? 1 : tbb::info::default_concurrency();
  auto threads = at_work(jobs, study, log, work);
  if (ranks != nullptr) {
    if (auto handed = hand_out(*ranks, study.patience, words_of(study, run), work); !handed) work.fail(handed.error());
  }
  for (OwnedThread& thread : threads) thread.join();
  if (ranks != nullptr && !work.fault()) {
    for (int other = 1; other < ranks->size(); ++other) ranks->send(other, kEnd, "");
    ranks->leave();
  }
  auto complete = work.complete();
  return SeedsDone{*std::move(results), std::move(complete)};
}

}  // namespace

Result<SeedsDone> run_seeds(const SeedStudy& study, const SeedRun& run, const Said& said, Ranks* ranks) {
  auto done = run_all(study, run, said, ranks);
  if (ranks == nullptr || ranks->left()) return done;
  // give_up() does not come back.
  if (!done) ranks->give_up(done.error());
  if (!done->all) ranks->give_up(done->all.error());
  return done;
}

}  // namespace birdseye::hw_sim
