#include "hw-sim/app/campaign_command.hpp"

#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <string>

#include "hw-sim/campaign/campaign.hpp"

namespace birdseye::hw_sim {

namespace {

// This very program, whatever stands at its path meanwhile.
constexpr const char* kOurselves = "/proc/self/exe";

struct CampaignOptions {
  SeedRun settings;
  std::string seeds;
  StudiedOperations operations;
  double patience_s = 3600;
  std::vector<std::string> command;
  bool print = false, alone = false, shortest = false;
};

/// FIRST:LAST, or one number.
Result<void> parse_seeds(const std::string& text, SeedRun& settings) {
  const auto number = [](std::string_view part, std::uint64_t& into) {
    const auto [end, fault] = std::from_chars(part.data(), part.data() + part.size(), into);
    return fault == std::errc() && end == part.data() + part.size();
  };
  const std::string_view all(text);
  const std::size_t colon = all.find(':');
  const std::string_view first = all.substr(0, colon);
  const std::string_view last = colon == std::string_view::npos ? first : all.substr(colon + 1);
  constexpr std::uint64_t kMost = 1'000'000'000, kMostAtOnce = 10'000'000;  // which are held in a list
  if (number(first, settings.first_seed) && number(last, settings.last_seed) &&
      settings.first_seed <= settings.last_seed && settings.last_seed <= kMost &&
      settings.last_seed - settings.first_seed < kMostAtOnce)
    return {};
  return Error{Errc::bad_value,
               "--seeds " + text + ": give FIRST:LAST, as 1:2000, up to 1000000000 and 10000000 of them"};
}

void print(const SeedRun& settings, const StudiedOperations& operations, const OperationResult& sum) {
  const auto share = [](std::uint64_t some, std::uint64_t all) {
    return all > 0 ? 100.0 * static_cast<double>(some) / static_cast<double>(all) : 0;
  };
  fmt::print("{}", sum.broken);
  fmt::print("{}", words_by_fault(sum));
  fmt::print("{} of the {} seeds from {} to {}: {:.0f} minutes, {} faults ({} of them alone), {} poses, {} frames\n",
             sum.operations, settings.last_seed - settings.first_seed + 1, settings.first_seed, settings.last_seed,
             sum.minutes, sum.faults, sum.faults_alone, sum.poses, sum.frames);
  fmt::print(
      "{} registrations by views, {} deformations, {} checks; transmitter or patient moved {} times without a "
      "reference, {} of them while no overlay was whole\n",
      sum.registrations, sum.deformations, sum.checks, sum.moved, sum.moved_unwatched);
  fmt::print(
      "overlay whole on {:.1f} % of pictures, {:.4f} % of those beyond 1.5 circles, worst {:.2f}; oldest {:.0f} ms\n",
      share(sum.green, sum.shown), share(sum.beyond, sum.judged), sum.worst_circles, sum.worst_age_ms);
  fmt::print("worst pose {:.2f} of what it may be off; {}\n", sum.worst_pose, words_of_faults(sum));
  fmt::print("{} recordings of the appliance, with {} events that had reached the window\n", sum.recordings,
             sum.found_again);
  fmt::print("{}\n", words_of_laws(sum));
  if (sum.laws_broken > 0) {
    fmt::print("birdseye-sim operation --seed SEED --minutes {}{} --shortest prints the fewest faults that break one\n",
               operations.minutes, operations.pictures ? " --pictures" : "");
  }
  std::fflush(stdout);
}

/// Of the first seed that broke a law.
void print_shortest(const SeedRun& settings, const StudiedOperations& operations, std::uint64_t seed) {
  constexpr Duration kPatience = Duration::from_ms(600'000);
  const auto script = shortest_script_of(seed, operations, kOurselves, settings.folder / "campaign.log", kPatience);
  fmt::print("the shortest script for seed {}:{}{}", seed, script ? "\n" : " ",
             script ? *script : script.error().what + "\n");
}

/// A line, at once.
void say(std::FILE* where, const std::string& line) {
  fmt::print(where, "{}\n", line);
  std::fflush(where);
}

/// Operations, and their sum, also where some seeds gave no result.
Result<void> run_operations(const SeedRun& settings, const CampaignOptions& options, Ranks* ranks, bool& broken) {
  const StudiedOperations& operations = options.operations;
  const auto study = study_of_operations(operations, kOurselves);
  if (!study) return study.error();
  const auto done = run_seeds(
      *study, settings, [](const std::string& line) { say(stdout, line); }, ranks);
  if (!done) return done.error();
  if (done->results == nullptr) return {};
  const auto sum = sum_of(*done->results, settings.first_seed, settings.last_seed);
  if (!sum) return sum.error();
  if (sum->operations == 0) {
    if (!done->all) return done->all;
    return Error{Errc::timeout, "no seed was run to its end, so nothing was judged; give it more time (--at-most)"};
  }
  print(settings, operations, *sum);
  broken = sum->laws_broken > 0;
  if (options.shortest && sum->first_broken) print_shortest(settings, operations, *sum->first_broken);
  return done->all;
}

/// Any other command. Standard output is for its lines.
Result<void> run_command(const SeedRun& settings, const CampaignOptions& options, Ranks* ranks) {
  const auto done = run_seeds(
      study_of(options.command, Duration::from_seconds(options.patience_s)), settings,
      [](const std::string& line) { say(stderr, line); }, ranks);
  if (!done) return done.error();
  if (done->results == nullptr || !options.print) return done->all;
  const auto print_line = [](const SeedLine& one) -> Result<void> {
    fmt::print("{}\n", one.line);
    return {};
  };
  const auto printed = done->results->for_each(settings.first_seed, settings.last_seed, print_line);
  return printed ? done->all : printed;
}

Result<void> run(const CampaignOptions& options, bool& broken) {
  SeedRun settings = options.settings;
  if (auto parsed = parse_seeds(options.seeds, settings); !parsed) return parsed;
  std::unique_ptr<Ranks> ranks;
  if (!options.alone) {
    auto joined = Ranks::join();
    if (!joined) return joined.error();
    ranks = *std::move(joined);
  }
  return options.command.empty() ? run_operations(settings, options, ranks.get(), broken)
                                 : run_command(settings, options, ranks.get());
}

}  // namespace

void add_campaign_command(CLI::App& app, const Take& take, bool& broken) {
  const auto options = std::make_shared<CampaignOptions>();
  CLI::App& command = *app.add_subcommand(
      "campaign", "operations of many seeds in virtual time, or any other command for each seed, on all cores");
  command.add_option("--seeds", options->seeds, "FIRST:LAST")->required();
  command.add_option("--out", options->settings.folder, "folder for the results; seeds that it has are not run again")
      ->required();
  CLI::Option* const minutes =
      command.add_option("--minutes", options->operations.minutes, "how long each operation is")
          ->check(CLI::Range(0.5, 600.0));
  CLI::Option* const pictures = command.add_flag("--pictures", options->operations.pictures,
                                                 "the video of each operation shows what the scope sees");
  command
      .add_option("--jobs", options->settings.jobs,
                  "seeds at a time (default: as many as there are cores; under mpirun one a rank)")
      ->check(CLI::Range(1, 1024));
  command.add_flag("--alone", options->alone, "run all seeds here, whatever has started this program beside others");
  command.add_option("--at-most", options->settings.at_most_s, "seconds after which no seed begins")
      ->check(CLI::Range(1.0, 1e6));
  CLI::Option* const shortest = command.add_flag(
      "--shortest", options->shortest,
      "where laws were broken, print the fewest faults that break the first law of the first such seed");
  CLI::Option* const other =
      command
          .add_option("command", options->command,
                      "in place of an operation, after --: prints one line of JSON for the seed that stands for {}")
          ->excludes(minutes)
          ->excludes(pictures)
          ->excludes(shortest);
  command.add_flag("--print", options->print, "print these lines in the end, by seed")->needs(other);
  command
      .add_option("--patience", options->patience_s, "seconds that the command may take for one seed (default 3600)")
      ->needs(other)
      ->check(CLI::Range(1.0, 1e6));
  command.callback([options, take, &broken] { take(run(*options, broken)); });
}

}  // namespace birdseye::hw_sim
