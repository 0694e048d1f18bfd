#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "hw-sim/campaign/ranks.hpp"
#include "hw-sim/campaign/seed_results.hpp"

namespace birdseye::hw_sim {

/// What is run for a seed.
struct SeedStudy {
  std::vector<std::string> command;  ///< prints one line; {} in it stands for the seed
  std::string what;                  ///< it is, in words
  std::string file;                  ///< the results' name
  Duration patience;                 ///< with one seed
  /// The line to keep, from what the command gave: its line, or why there is none. An error: none is kept, and the seed
  /// is run again the next time.
  std::function<Result<std::string>(std::uint64_t seed, const Result<std::string>& given)> kept;
  std::string told;  ///< of how many lines it is told as it goes: "broke a law"; empty: of none
  std::function<bool(const std::string& line)> tells;
};

/// Which seeds, and how.
struct SeedRun {
  std::uint64_t first_seed = 1, last_seed = 1;
  std::filesystem::path folder;     ///< gets the results, and campaign.log with what commands said
  int jobs = 0;                     ///< at a time; 0: as many as there are cores, or one a rank
  std::optional<double> at_most_s;  ///< none begins after so long; empty: all seeds are run
};

/// What came of a run.
struct SeedsDone {
  std::unique_ptr<SeedResults> results;  ///< all that the folder has; nullptr in every rank but rank 0
  Result<void> all;                      ///< an error: some seeds gave nothing to keep, or the run was stopped
};

/// A line of progress.
using Said = std::function<void(const std::string&)>;

/// Runs each seed that the folder has no result of, in a process of its own, handed out by need. said: told from time
/// to time how far it is. A run that was ended goes on where it is started again. A seed that gives nothing to keep is
/// tried again by the next run; ten such seeds in a row stop this one.
/// ranks: all of them call this, and none uses MPI afterwards. Rank 0 hands out, has the results, works itself as the
/// others do, and refuses a rank that would run anything else. What goes wrong in one of them ends all.
Result<SeedsDone> run_seeds(const SeedStudy& study, const SeedRun& run, const Said& said, Ranks* ranks = nullptr);

}  // namespace birdseye::hw_sim
