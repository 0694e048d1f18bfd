#include "hw-sim/app/operation_command.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "host/files/write_files.hpp"
#include "hw-sim/app/kept_inputs.hpp"
#include "hw-sim/campaign/operation_results.hpp"
#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/operation/operation.hpp"
#include "hw-sim/operation/shortest_script.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kLeast_minutes = 0.5, kMost_minutes = 600;

struct OperationOptions {
  SimulatedOperation operation;
  std::filesystem::path script, log, faults;
  std::string reference;
  int cores = 0;  ///< none given: all for pictures, else one
  bool line = false, shortest = false;
};

OperationResult result_of(const SimulatedOperation& operation, const OperationOutcome& out) {
  OperationResult result;
  result.seed = operation.seed;
  result.minutes = operation.minutes;
  result.laws_broken = out.broken.size();
  result.laws_untold = result.laws_broken >= kMostLawsTold;
  for (const BrokenLaw& law : out.broken)
    result.broken += fmt::format("{}{:.3f} s {}: {}", result.broken.empty() ? "" : "; ", law.at_s, law.law, law.what);
  result.hash = fmt::format("{:016x}", out.hash);
  const OperationLaws::Figures& laws = out.laws;
  result.faults = laws.faults;
  result.faults_alone = laws.faults_judged;
  result.poses = laws.poses;
  result.frames = laws.frames;
  result.shown = laws.shown;
  result.overlaid = laws.overlaid;
  result.green = laws.green;
  result.judged = laws.judged;
  result.beyond = laws.beyond;
  result.registrations = out.registrations;
  result.deformations = out.deformations;
  result.checks = out.checks;
  result.moved = laws.moved;
  result.moved_unwatched = laws.moved_unwatched;
  result.recordings = out.recordings;
  result.found_again = out.found_again;
  result.worst_pose = laws.worst_pose;
  result.worst_age_ms = laws.worst_age_ms;
  result.worst_circles = laws.worst_circles;
  result.slowest_named_s = laws.slowest_named_s;
  result.slowest_over_s = laws.slowest_over_s;
  for (const auto& [name, of] : laws.by_fault)
    result.by_fault[name] = {of.befell, of.judged, of.slowest_named_s, of.slowest_over_s};
  return result;
}

/// The first law that was broken, by as few faults as still break it.
Result<void> print_shortest(const SimulatedOperation& operation, const OperationOutcome& out) {
  constexpr double kAfter_s = 12;  // a law may be judged some seconds after what it judges
  const std::string law = out.broken.front().law;
  SimulatedOperation shorter = operation;
  const double needed = std::max(kLeast_minutes, (out.broken.front().at_s + kAfter_s) / 60);
  shorter.minutes = std::min(operation.minutes, std::ceil(100 * needed) / 100);
  std::optional<Error> failed;
  const auto breaks = [&](const FaultScript& script) {
    shorter.faults = script;
    const auto tried = run_operation(shorter);
    if (!tried) failed = tried.error();
    return tried && std::ranges::any_of(tried->broken, [&](const BrokenLaw& one) { return one.law == law; });
  };
  FaultScript script = out.faults;
  if (!breaks(script)) shorter.minutes = operation.minutes;
  script = shortest_script(script, breaks);
  if (failed) return *failed;
  fmt::print("# {} is broken by this script: birdseye-sim operation --seed {} --minutes {}{}{} --script FILE\n{}", law,
             operation.seed, shorter.minutes, operation.pictures ? " --pictures" : "",
             fmt::format(" --reference {}", out.reference ? "patient" : "none"), text_of(script));
  return {};
}

void print(const OperationOutcome& out, const OperationResult& result) {
  const double share = result.shown > 0 ? static_cast<double>(result.green) / static_cast<double>(result.shown) : 0;
  for (const BrokenLaw& law : out.broken) fmt::print("broken at {:.3f} s: {}: {}\n", law.at_s, law.law, law.what);
  fmt::print(
      "seed {}: {:g} minutes, {} faults ({} of them alone), {} poses, {} frames, {} registrations, {} deformations, {} "
      "checks\n",
      result.seed, result.minutes, result.faults, result.faults_alone, result.poses, result.frames,
      result.registrations, result.deformations, result.checks);
  fmt::print("reference: {}{}\n", out.reference ? "patient" : "none",
             out.laws.moved == 0
                 ? ""
                 : fmt::format("; transmitter or patient moved {} times, {} of them while no overlay was whole",
                               out.laws.moved, out.laws.moved_unwatched));
  fmt::print("overlay whole on {:.1f} % of pictures, {} of {} beyond 1.5 circles, worst {:.2f}; oldest {:.0f} ms\n",
             100 * share, result.beyond, result.judged, result.worst_circles, result.worst_age_ms);
  fmt::print("worst pose {:.2f} of what it may be off; {}\n", result.worst_pose, words_of_faults(result));
  if (result.recordings > 0)
    fmt::print("{} recordings of the appliance, with {} events that had reached the window\n", result.recordings,
               result.found_again);
  fmt::print("{}; hash {}\n", words_of_laws(result), result.hash);
}

/// Whether write_files() will surely fail there, as far as can be told before there is anything to write.
Result<void> check_output(const std::filesystem::path& file) {
  if (file.empty()) return {};
  std::error_code ignored;
  const bool as_it_is = host::stays(file);
  const auto folder = std::filesystem::absolute(file, ignored).parent_path();
  if (std::filesystem::is_directory(file, ignored))
    return Error{Errc::unreadable, file.string() + ": is a folder; give a file"};
  if (::access(as_it_is ? file.c_str() : folder.c_str(), W_OK) == 0) return {};
  return Error{Errc::unreadable, file.string() + ": cannot be written; check the folder and its permissions"};
}

/// Before an operation of minutes is run for them.
Result<void> check_outputs(const OperationOptions& options) {
  if (auto kept = keep_inputs({options.log, options.faults}, {options.script}); !kept) return kept;
  const bool both = !options.log.empty() && !options.faults.empty() && !host::stays(options.log);
  if (both && host::same_file(options.log, options.faults))
    return Error{Errc::bad_value, options.log.string() + ": is named by --log and by --faults; give two files"};
  if (auto log = check_output(options.log); !log) return log;
  return check_output(options.faults);
}

Result<void> run(const OperationOptions& options, bool& broken) {
  if (auto checked = check_outputs(options); !checked) return checked;
  SimulatedOperation operation = options.operation;
  // Without pictures other cores would only wait for work: a third of all processor time.
  const int cores = options.cores > 0 ? options.cores : operation.pictures ? tbb::info::default_concurrency() : 1;
  const tbb::global_control at_most(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(cores));
  if (!options.reference.empty()) operation.reference = options.reference == "patient";
  if (!options.script.empty()) {
    auto script = read_fault_script(options.script, Instruments::with_programs, operation.seed);
    if (!script) return script.error();
    operation.faults = *std::move(script);
  }
  spdlog::set_level(spdlog::level::off);  // the appliance's own log: what it says to the host is in ours
  const auto out = run_operation(operation);
  if (!out) return out.error();
  const OperationResult result = result_of(operation, *out);
  options.line ? fmt::print("{}\n", line_of(result)) : print(*out, result);
  broken = result.laws_broken > 0;
  std::fflush(stdout);  // the files may be on a disk that is full
  const auto written = host::write_files({{options.log, out->log}, {options.faults, text_of(out->faults)}});
  const auto shortest = broken && options.shortest ? print_shortest(operation, *out) : Result<void>();
  return written ? shortest : written;
}

}  // namespace

void add_operation_command(CLI::App& app, const Take& take, bool& broken) {
  const auto options = std::make_shared<OperationOptions>();
  CLI::App& command = *app.add_subcommand(
      "operation", "one operation in virtual time, with faults at random: whether anything breaks a law");
  command.add_option("--seed", options->operation.seed, "everything random follows from it");
  command.add_option("--minutes", options->operation.minutes, "how long it is")
      ->check(CLI::Range(kLeast_minutes, kMost_minutes));
  command.add_flag("--pictures", options->operation.pictures,
                   "the video shows what the scope sees, and the window watches how it moves");
  command
      .add_option("--reference", options->reference,
                  "patient: a reference bird is fixed on him; none: there is none; else the seed decides")
      ->check(CLI::IsMember({"patient", "none"}));
  command
      .add_option("--cores", options->cores,
                  "it uses so many at most (default: one, with --pictures all); what comes of it is the same")
      ->check(CLI::Range(1, 1024));
  command.add_option("--script", options->script, "these faults (TOML) in place of random ones");
  command.add_option("--log", options->log, "write what happened to this file");
  command.add_option("--faults", options->faults, "write the faults that befell to this file, as --script takes them");
  command.add_flag("--shortest", options->shortest,
                   "where a law is broken, look for the fewest faults that break it, and print them as a script");
  command.add_flag("--line", options->line, "print what came of it as one line of JSON");
  command.callback([options, take, &broken] { take(run(*options, broken)); });
}

}  // namespace birdseye::hw_sim
