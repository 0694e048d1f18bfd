#include "host/bench/register_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/system/progress.hpp"
#include "host/app/commands.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchRegisterOptions {
  std::filesystem::path json, study;
  std::vector<std::string> sweeps = StudyOptions{}.sweeps;
  std::optional<int> trials;
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
      "{:6} {:8} {:3} DOF  success {:3.0f} %  epsilon {:.6f} to {:.6f}  error {:.2f} to {:.2f} mm  {:.0f} evaluations  "
      "{:.2f} s\n",
      row["phantom"].get<std::string>(), row["optimiser"].get<std::string>(), row["dof"].get<int>(),
      100 * row["success_rate"].get<double>(), row["epsilon_before_median"].get<double>(),
      row["epsilon_after_median"].get<double>(), row["tre_before_mm_mean"].get<double>(),
      row["tre_after_mm_mean"].get<double>(), row["evaluations_median"].get<double>(),
      row["time_s_median"].get<double>());
  std::fflush(stdout);
}

Result<ExitCode> bench_register(const BenchRegisterOptions& options) {
  constexpr int kQuick = 5, kTrials = 50;
  const int trials = options.quick ? kQuick : options.trials.value_or(kTrials);
  nlohmann::json rows = nlohmann::json::array();
  Progress progress;
  for (const std::string& phantom : options.phantoms) {
    for (const Group& group : groups()) {
      const int dof = 3 * group.inner * group.inner * group.inner;
      if (std::find(options.dof.begin(), options.dof.end(), dof) == options.dof.end()) continue;
      SimulatedCase wanted = options.simulated;
      wanted.phantom = phantom;
      wanted.inner = group.inner;
      std::vector<std::vector<Trial>> of_method(group.methods.size());
      auto done = for_cases(wanted, trials, [&](const RegistrationCase& c, int seed) -> Result<void> {
        for (std::size_t m = 0; m < group.methods.size(); ++m) {
          progress(fmt::format("{}, seed {}: {}", phantom, seed, group.methods[m].optimiser));
          auto trial = try_once(c, group.methods[m]);
          if (!trial) return trial.error();
          of_method[m].push_back(*trial);
        }
        return {};
      });
      if (!done) return done.error();
      for (std::size_t m = 0; m < group.methods.size(); ++m) {
        nlohmann::json row = summary_of(of_method[m]);
        row.update({{"phantom", phantom},
                    {"optimiser", group.methods[m].optimiser},
                    {"dof", dof},
                    {"views", wanted.views},
                    {"viewport", wanted.size},
                    {"amplitude_mm", wanted.amplitude_mm}});
        print(row);
        rows.push_back(std::move(row));
      }
      // Many trials take an hour: what there is, is kept.
      if (auto written = write_files({{options.json, text_of(report_of(rows))}}); !written) return written.error();
    }
  }
  return report_of(rows)["verdict"] == "pass" ? ExitCode::success : ExitCode::verdict_fail;
}

Result<void> study(const BenchRegisterOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(options.study, error);
  if (error) {
    return Error{Errc::unreadable,
                 fmt::format("--study {}: cannot be made; choose another folder", options.study.string())};
  }
  constexpr int kQuick = 2;
  const int trials = options.trials.value_or(StudyOptions{}.trials);
  return register_study({options.study, options.quick ? kQuick : trials, options.sweeps, options.simulated});
}

}  // namespace

void add_bench_register(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchRegisterOptions>();
  CLI::App& command =
      *bench.add_subcommand("register", "the paper's Figure 6 on simulated video, its optimisers and ours");
  command.add_option("--json", options->json, "write the table to this file");
  command.add_option("--trials", options->trials, "random deformations of each kind (default 50; of a study 8)")
      ->check(CLI::Range(1, 1000));
  command.add_flag("--quick", options->quick, "5 trials");
  command.add_option("--phantom", options->phantoms, "only these: liver, head")
      ->check(CLI::IsMember({"liver", "head"}));
  command.add_option("--dof", options->dof, "only these: 3, 81")->check(CLI::IsMember({3, 81}));
  CLI::Option* const views =
      command.add_option("--views", options->simulated.views, "of each case (default 5)")->check(CLI::Range(1, 20));
  command.add_option("--size", options->simulated.size, "of the views (default 768x576)")
      ->check(CLI::IsMember({"768x576", "384x288"}));
  CLI::Option* const amplitude =
      command.add_option("--amplitude-mm", options->simulated.amplitude_mm, "of the deformation (default 10)")
          ->check(CLI::Range(0.5, 30.0));
  command
      .add_option("--study", options->study, "in place of the table: curves and sweeps on the liver, to this folder")
      ->excludes(views)
      ->excludes(amplitude);
  command.add_option("--sweep", options->sweeps, "of the study, only these: light, noise, views, error")
      ->check(CLI::IsMember(StudyOptions{}.sweeps));
  command.callback([options, &status] {
    if (!options->study.empty()) return status.take(study(*options));
    const auto done = bench_register(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
