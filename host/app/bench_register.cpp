#include "host/bench/register_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/system/progress.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/app/commands.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/factor_study.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchRegisterOptions {
  std::filesystem::path json, study, lines;
  std::optional<int> seed;
  std::vector<std::string> sweeps = StudyOptions{}.sweeps;
  std::optional<int> trials;
  FactorOptions factors;
  bool quick = false;
  std::vector<std::string> phantoms{"liver", "head"};
  std::vector<int> dof{3, 81};
  SimulatedCase simulated;
};

/// Methods that are tried on the same cases.
struct Group {
  int inner;
  std::vector<Method> methods;
};
std::vector<Group> groups() {
  return {{1, {{"simplex"}, {"powell"}, {"gradient"}}}, {3, {{"gradient"}}}};
}

/// Calls `each` with every kind of case that is asked for, and the methods that are tried on it.
template <typename Each>
Result<void> for_kinds(const BenchRegisterOptions& options, const Each& each) {
  for (const std::string& phantom : options.phantoms) {
    for (const Group& group : groups()) {
      const int dof = 3 * group.inner * group.inner * group.inner;
      if (std::find(options.dof.begin(), options.dof.end(), dof) == options.dof.end()) continue;
      SimulatedCase wanted = options.simulated;
      wanted.phantom = phantom;
      wanted.inner = group.inner;
      if (auto done = each(wanted, dof, group.methods); !done) return done;
    }
  }
  return {};
}

nlohmann::json name_of(const SimulatedCase& wanted, int dof) {
  return {{"phantom", wanted.phantom},
          {"dof", dof},
          {"views", wanted.views},
          {"viewport", wanted.size},
          {"amplitude_mm", wanted.amplitude_mm}};
}

/// The verdict is that every method leaves less error than it found; how much less depends on the trials.
nlohmann::json report_of(const nlohmann::json& rows) {
  const bool sound = std::all_of(rows.begin(), rows.end(), [](const nlohmann::json& row) {
    return row["epsilon_after_median"].get<double>() < row["epsilon_before_median"].get<double>();
  });
  return {{"rows", rows},
          {"machine", bench_machine()},
          {"verdict", sound ? "pass" : "fail"},
          {"reasons",
           {sound ? "every method leaves less error than it found" : "a method leaves more error than it found"}}};
}

void print(const nlohmann::json& row) {
  fmt::print(
      "{:6} {:8} {:3} DOF  success {:3.0f} %  epsilon {:.6f} to {:.6f}  error {:.2f} to {:.2f} mm  {:.0f} "
      "evaluations{}\n",
      row["phantom"].get<std::string>(), row["optimiser"].get<std::string>(), row["dof"].get<int>(),
      100 * row["success_rate"].get<double>(), row["epsilon_before_median"].get<double>(),
      row["epsilon_after_median"].get<double>(), row["tre_before_mm_mean"].get<double>(),
      row["tre_after_mm_mean"].get<double>(), row["evaluations_median"].get<double>(),
      row.contains("time_s_median") ? fmt::format("  {:.2f} s", row["time_s_median"].get<double>()) : "");
  std::fflush(stdout);
}

ExitCode code_of(const nlohmann::json& rows) {
  return report_of(rows)["verdict"] == "pass" ? ExitCode::success : ExitCode::verdict_fail;
}

Result<ExitCode> bench_register(const BenchRegisterOptions& options) {
  constexpr int kQuick = 5, kTrials = 50;
  const int trials = options.quick ? kQuick : options.trials.value_or(kTrials);
  nlohmann::json rows = nlohmann::json::array();
  Progress progress;
  auto all =
      for_kinds(options, [&](const SimulatedCase& wanted, int dof, const std::vector<Method>& methods) -> Result<void> {
        std::vector<std::vector<Trial>> of_method(methods.size());
        auto done = for_cases(wanted, trials, [&](const RegistrationCase& c, int seed) -> Result<void> {
          for (std::size_t m = 0; m < methods.size(); ++m) {
            progress(fmt::format("{}, seed {}: {}", wanted.phantom, seed, methods[m].optimiser));
            auto trial = try_once(c, methods[m]);
            if (!trial) return trial.error();
            of_method[m].push_back(*trial);
          }
          return {};
        });
        if (!done) return done.error();
        for (std::size_t m = 0; m < methods.size(); ++m) {
          nlohmann::json row = summary_of(of_method[m]);
          row.update(name_of(wanted, dof));
          row["optimiser"] = methods[m].optimiser;
          print(row);
          rows.push_back(std::move(row));
        }
        // Many trials take an hour: what there is, is kept.
        return write_files({{options.json, text_of(report_of(rows))}});
      });
  if (!all) return all.error();
  return code_of(rows);
}

/// One line of JSON: every trial of the seed, or that the simulator refuses it. No times, which are others each time.
Result<void> print_seed(BenchRegisterOptions options) {
  options.simulated.seed = *options.seed;
  nlohmann::json trials = nlohmann::json::array();
  auto all =
      for_kinds(options, [&](const SimulatedCase& wanted, int dof, const std::vector<Method>& methods) -> Result<void> {
        nlohmann::json trial = name_of(wanted, dof);
        const auto c = simulate(wanted);
        if (!c && c.error().code != Errc::bad_value) return c.error();
        if (!c) {
          trial["refused"] = c.error().what;
          trials.push_back(trial);
          return {};
        }
        for (const Method& method : methods) {
          const auto tried = try_once(*c, method);
          if (!tried) return tried.error();
          trial["optimiser"] = method.optimiser;
          trial["trial"] = json_of(*tried);
          trials.push_back(trial);
        }
        return {};
      });
  if (!all) return all;
  fmt::print("{}\n", nlohmann::json{{"seed", *options.seed}, {"trials", trials}}.dump());
  return {};
}

/// The table of lines that print_seed() printed.
Result<ExitCode> table_of_lines(const BenchRegisterOptions& options) {
  const auto whole = read_whole_file(options.lines, kMostTextBytes);
  if (!whole) return whole.error();
  std::istringstream in(*whole);
  struct Kind {
    nlohmann::json name;
    std::vector<Trial> trials;
  };
  std::vector<Kind> kinds;
  try {
    for (std::string line; std::getline(in, line);) {
      const nlohmann::json all = nlohmann::json::parse(line);
      for (nlohmann::json kind : all.at("trials")) {
        if (kind.contains("refused")) continue;
        const Trial trial = trial_of(kind.at("trial"));
        kind.erase("trial");
        auto known = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& one) { return one.name == kind; });
        if (known == kinds.end()) known = kinds.insert(known, {kind, {}});
        known->trials.push_back(trial);
      }
    }
  } catch (const nlohmann::json::exception&) {
    return Error{Errc::bad_format, fmt::format("{}: these are no lines that --seed prints", options.lines.string())};
  }
  if (kinds.empty()) return Error{Errc::bad_format, options.lines.string() + ": has no trial"};
  nlohmann::json rows = nlohmann::json::array();
  for (const Kind& kind : kinds) {
    nlohmann::json row = summary_of(kind.trials);
    row.update(kind.name);
    row.erase("time_s_median");
    row.erase("processor_s_median");
    print(row);
    rows.push_back(std::move(row));
  }
  if (auto written = write_files({{options.json, text_of(report_of(rows))}}); !written) return written.error();
  return code_of(rows);
}

Result<void> study(const BenchRegisterOptions& options) {
  constexpr int kQuick = 2;
  const int trials = options.trials.value_or(StudyOptions{}.trials);
  return register_study({options.study, options.quick ? kQuick : trials, options.sweeps, options.simulated});
}

Result<void> factors(const BenchRegisterOptions& options) {
  FactorOptions of = options.factors;
  of.trials = options.trials.value_or(of.trials);
  of.size = options.simulated.size;
  std::error_code error;
  std::filesystem::create_directories(of.folder, error);
  if (error) {
    return Error{Errc::unreadable,
                 fmt::format("--factors {}: cannot be made; choose another folder", of.folder.string())};
  }
  return factor_study(of);
}

/// Options of --factors alone.
void add_factors(CLI::App& command, FactorOptions& factors, const std::vector<CLI::Option*>& not_with) {
  CLI::Option* const folder =
      command.add_option("--factors", factors.folder,
                         "in place of the table: one factor at a time, to this folder; goes on with what is there");
  for (CLI::Option* option : not_with) folder->excludes(option);
  const auto only = [&](CLI::Option* option) { option->needs(folder); };
  only(command.add_option("--only", factors.only, "of the factors, only these classes: NAME,NAME (default all)")
           ->delimiter(','));
  only(command.add_option("--optimiser", factors.optimisers, "geometry, gradient, simplex, powell (default geometry)")
           ->delimiter(',')
           ->check(CLI::IsMember({"geometry", "gradient", "simplex", "powell"})));
  only(command.add_option("--first-seed", factors.first_seed, "of the trials (default 1)")
           ->check(CLI::Range(1, 1'000'000)));
  only(command.add_option("--jobs", factors.jobs, "cases at a time (default: one a core; 1: all cores on one case)")
           ->check(CLI::Range(1, 256)));
}

}  // namespace

void add_bench_register(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchRegisterOptions>();
  CLI::App& command =
      *bench.add_subcommand("register", "the paper's Figure 6 on simulated video, its optimisers and ours");
  CLI::Option* const json = command.add_option("--json", options->json, "write the table to this file");
  command
      .add_option("--trials", options->trials,
                  "random deformations of each kind (default 50; of a study 8, of factors 20)")
      ->check(CLI::Range(1, 1000));
  CLI::Option* const quick = command.add_flag("--quick", options->quick, "5 trials");
  CLI::Option* const phantom = command.add_option("--phantom", options->phantoms, "only these: liver, head")
                                   ->check(CLI::IsMember({"liver", "head"}));
  CLI::Option* const dof =
      command.add_option("--dof", options->dof, "only these: 3, 81")->check(CLI::IsMember({3, 81}));
  CLI::Option* const views =
      command.add_option("--views", options->simulated.views, "of each case (default 5)")->check(CLI::Range(1, 20));
  command.add_option("--size", options->simulated.size, "of the views (default 768x576)")
      ->check(CLI::IsMember({"768x576", "384x288"}));
  CLI::Option* const amplitude =
      command.add_option("--amplitude-mm", options->simulated.amplitude_mm, "of the deformation (default 10)")
          ->check(CLI::Range(0.5, 30.0));
  CLI::Option* const study_folder =
      command
          .add_option("--study", options->study,
                      "in place of the table: curves and sweeps on the liver, to this folder")
          ->excludes(views)
          ->excludes(amplitude);
  CLI::Option* const seed =
      command
          .add_option("--seed", options->seed,
                      "in place of the table: the trials of this seed, as one line of JSON without times")
          ->check(CLI::Range(1, 1'000'000))
          ->excludes(json)
          ->excludes(quick)
          ->excludes(study_folder);
  CLI::Option* const lines =
      command.add_option("--lines", options->lines, "the table of the lines in this file, which --seed printed")
          ->check(CLI::ExistingFile);
  for (CLI::Option* option : {quick, phantom, dof, views, amplitude, study_folder, seed}) lines->excludes(option);
  command.add_option("--sweep", options->sweeps, "of the study, only these: light, noise, views, error")
      ->check(CLI::IsMember(StudyOptions{}.sweeps));
  add_factors(command, options->factors, {json, quick, phantom, dof, views, amplitude, study_folder, seed, lines});
  command.callback([options, &status] {
    if (!options->factors.folder.empty()) return status.take(factors(*options));
    if (!options->study.empty()) return status.take(study(*options));
    if (options->seed) return status.take(print_seed(*options));
    const auto done = options->lines.empty() ? bench_register(*options) : table_of_lines(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
