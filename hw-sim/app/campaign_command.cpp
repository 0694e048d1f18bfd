#include "hw-sim/app/campaign_command.hpp"

#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <string>

#include "drivers/system/local_programs.hpp"
#include "hw-sim/campaign/campaign.hpp"

namespace birdseye::hw_sim {

namespace {

struct CampaignOptions {
  CampaignSettings settings;
  std::string seeds;
};

/// FIRST:LAST, or one number.
Result<void> parse_seeds(const std::string& text, CampaignSettings& settings) {
  const auto number = [](std::string_view part, std::uint64_t& into) {
    const auto [end, fault] = std::from_chars(part.data(), part.data() + part.size(), into);
    return fault == std::errc() && end == part.data() + part.size();
  };
  const std::string_view all(text);
  const std::size_t colon = all.find(':');
  const std::string_view first = all.substr(0, colon);
  const std::string_view last = colon == std::string_view::npos ? first : all.substr(colon + 1);
  constexpr std::uint64_t kMost = 1'000'000'000;
  if (number(first, settings.first_seed) && number(last, settings.last_seed) &&
      settings.first_seed <= settings.last_seed && settings.last_seed <= kMost)
    return {};
  return Error{Errc::bad_value, "--seeds " + text + ": give FIRST:LAST, as 1:2000, up to 1000000000"};
}

void print(const CampaignSettings& settings, const OperationResult& sum) {
  const auto share = [](std::uint64_t some, std::uint64_t all) {
    return all > 0 ? 100.0 * static_cast<double>(some) / static_cast<double>(all) : 0;
  };
  fmt::print("{}", sum.broken);
  fmt::print("of seeds {} to {}: {:.0f} minutes, {} faults ({} of them alone), {} poses, {} frames\n",
             settings.first_seed, settings.last_seed, sum.minutes, sum.faults, sum.faults_alone, sum.poses, sum.frames);
  fmt::print(
      "overlay whole on {:.1f} % of pictures, {:.4f} % of those beyond 1.5 circles, worst {:.2f}; oldest {:.0f} ms\n",
      share(sum.green, sum.shown), share(sum.beyond, sum.green), sum.worst_circles, sum.worst_age_ms);
  fmt::print("worst pose {:.2f} of what it may be off; faults named within {:.2f} s, over within {:.2f} s\n",
             sum.worst_pose, sum.slowest_named_s, sum.slowest_over_s);
  fmt::print("{} laws broken\n", sum.laws_broken);
}

Result<void> run(const CampaignOptions& options, bool& broken) {
  CampaignSettings settings = options.settings;
  if (auto parsed = parse_seeds(options.seeds, settings); !parsed) return parsed;
  settings.program = beside_us("birdseye-sim");
  const auto sum = run_campaign(settings, [](const std::string& line) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
  });
  if (!sum) return sum.error();
  print(settings, *sum);
  broken = sum->laws_broken > 0;
  return {};
}

}  // namespace

void add_campaign_command(CLI::App& app, const Take& take, bool& broken) {
  const auto options = std::make_shared<CampaignOptions>();
  CLI::App& command = *app.add_subcommand("campaign", "operations of many seeds in virtual time, on all cores");
  command.add_option("--seeds", options->seeds, "FIRST:LAST")->required();
  command
      .add_option("--out", options->settings.folder,
                  "folder for operations.sqlite; seeds that are in it are not run again")
      ->required();
  command.add_option("--minutes", options->settings.minutes, "how long each operation is")
      ->check(CLI::Range(0.5, 600.0));
  command.add_option("--jobs", options->settings.jobs, "operations at a time (default: as many as there are cores)")
      ->check(CLI::Range(1, 1024));
  command.add_option("--at-most", options->settings.at_most_s, "seconds after which no operation begins")
      ->check(CLI::Range(1.0, 1e6));
  command.callback([options, take, &broken] { take(run(*options, broken)); });
}

}  // namespace birdseye::hw_sim
