#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "drivers/system/program.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/pose_options.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/tip_calibration.hpp"
#include "host/calibrate/tip_phases.hpp"
#include "host/calibrate/tip_report.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_files.hpp"
#include "host/guide/live_poses.hpp"
#include "host/link/appliance_hardware.hpp"

namespace birdseye::host {

namespace {

using calibration::Pivot;

struct CalibrateTipOptions {
  std::filesystem::path poses, spin, body;
  std::string transform, reference, phases;
  PoseOptions poses_are;
  std::string server, bird = "pointer";
  double seconds = 20;
  ResultPaths results;
};

Result<PoseSet> read_set(const CalibrateTipOptions& options, const AdmittedField& field,
                         const std::filesystem::path& path) {
  PoseReading how = pose_reading(options.poses_are, field.map);
  how.transform = options.transform;
  how.reference = options.reference;
  how.body = options.body;
  return read_pose_set(path, how);
}

/// Refuses, by its name, what was given and would be of no effect.
Result<void> check(const CLI::App& tip, const CalibrateTipOptions& options) {
  if (options.poses.empty() == options.server.empty())
    return Error{Errc::bad_value, "calibrate tip: give one of --poses and --server"};
  if (options.server.empty()) return refuse_given(tip, {"--bird", "--seconds"}, "goes with --server");
  if (!options.poses_are.field.empty())
    return Error{Errc::bad_value, "--field goes with --poses: an appliance corrects by its own [calibration] field"};
  if (auto fine = refuse_given(tip, {"--reference", "--body", "--max-error"}, "goes with --poses"); !fine) return fine;
  if (!options.spin.empty()) return {};
  return refuse_given(tip, {"--unit", "--time-unit", "--column-major", "--poses-are", "--transform"},
                      "goes with --poses or --spin");
}

Result<TipInput> read_input(const CalibrateTipOptions& options, const AdmittedField& field) {
  if (!options.server.empty()) {
    if (const auto fits = check_bound_record(options.results.record, options.server, {"tracker"}); !fits)
      return fits.error();
  }
  Progress progress;
  auto set = options.poses.empty() ? collect_poses(options.server, options.bird, options.seconds, progress)
                                   : read_set(options, field, options.poses);
  if (!set) return set.error();
  std::vector<Phase> phases;
  if (!options.phases.empty()) {
    auto parsed = parse_phases(options.phases);
    if (!parsed) return parsed.error();
    phases = *std::move(parsed);
  }
  auto input = tip_input_of(*std::move(set), phases);
  if (!input) return input.error().with_context(options.poses.string());
  input->relative = !options.reference.empty();
  input->direction_said = !options.poses_are.direction.empty() || options.poses.empty();
  input->unit_said = !options.poses_are.unit.empty() || options.poses.empty();
  input->inverted = options.poses_are.direction == "sensor_from_tracker" && !options.poses.empty();
  input->source = options.poses.empty() ? options.server : options.poses.filename().string();
  if (!options.spin.empty()) {
    auto spin = read_set(options, field, options.spin);
    if (!spin) return spin.error();
    input->spin = *std::move(spin);
  }
  return input;
}

void print(const TipFound& found, const TipInput& input) {
  constexpr std::size_t kNamed = 12;
  const auto shorten = [](std::vector<std::string> names) {
    const std::size_t count = names.size();
    if (count > kNamed) names.resize(kNamed);
    return fmt::format("{}{}", fmt::join(names, ", "), count > kNamed ? ", ..." : "");
  };
  if (!input.set.rejected.empty()) {
    fmt::print("{} {} rejected:\n", input.set.rejected.size(), input.set.rejected.size() == 1 ? "pose" : "poses");
    for (const std::string& line : by_kind(input.set.rejected)) print_line(fmt::format("  {}", line));
  }
  for (const std::string& note : input.set.notes) print_line(note);
  if (found.pivot) {
    const Pivot& p = *found.pivot;
    fmt::print("tip in the sensor's frame {} mm, {}\n", xyz_text(p.robust.tip_in_sensor_mm, 3), tip_sigma_text(p));
    if (!p.outliers.empty()) {
      std::vector<std::string> names;
      for (const std::size_t i : p.outliers) names.push_back(input.set.poses[i].name);
      print_line(fmt::format("{} of {} poses are outliers: {}", names.size(), input.poses.size(), shorten(names)));
    }
  }
  if (found.axis) fmt::print("axis in the sensor's frame {}\n", xyz_text(found.axis->axis_in_sensor, 4));
}

/// What a record keeps of it.
RecordEntry entry_of(const TipFound& found, const TipInput& input, const std::string& doubt) {
  const std::string made_from =
      fmt::format("{} poses of {} in {} divot(s)", input.set.poses.size(), input.source, input.divots);
  return {made_from,
          [&found](calibration::CalibrationRecord& record, const calibration::Provenance& provenance) {
            const Pivot& pivot = *found.pivot;
            record.tip = calibration::TipEntry{provenance, pivot.robust.tip_in_sensor_mm, pivot.tip_covariance_mm2,
                                               pivot.robust.rms_mm};
          },
          doubt};
}

}  // namespace

void add_calibrate_tip(CLI::App& calibrate, CommandStatus& status) {
  const auto options = std::make_shared<CalibrateTipOptions>();
  CLI::App& tip = *calibrate.add_subcommand("tip", "where a pointer's tip is on its sensor, by a pivot");
  tip.add_option(
      "--poses,--recording", options->poses,
      "poses while the tip stands in a divot: a folder of 4x4 matrices, a table, an NDI log, a PLUS sequence "
      "or a session recording");
  tip.add_option("--server", options->server, "an appliance that runs: take the poses from it, now")
      ->type_name("[NAME@]HOST:PORT");
  tip.add_option("--bird", options->bird, "the pointer's bird, as the appliance names it (default: pointer)");
  tip.add_option("--seconds", options->seconds, "how long to take poses from it (default: 20)")
      ->check(CLI::Range(2.0, 600.0));
  tip.add_option("--transform,--tool", options->transform,
                 "the pointer's name, in a file of several tools, as StylusToTracker");
  tip.add_option("--body", options->body,
                 "the pointer's points, name,x,y,z a line: the poses are then tables of where these were tracked")
      ->type_name("FILE");
  tip.add_option("--reference", options->reference,
                 "what the divot is fixed to, where it moves too, as ReferenceToTracker");
  tip.add_option("--phases", options->phases,
                 "which frames were in which divot, first-last of each, as 77-162,172-253 (default: all in one)");
  tip.add_option("--spin", options->spin, "poses while the pointer is spun about its shaft: gives its axis, too");
  add_pose_options(tip, options->poses_are);
  add_result_options(tip, options->results, "the tip, x y z in the sensor's frame, mm");
  allow_unsigned_sources(tip);
  tip.callback([options, &tip, &status] {
    if (const auto fine = check(tip, *options); !fine) return status.refuse(fine.error());
    const auto source = admit_sources({options->poses, options->spin}, options->results);
    if (!source) return status.refuse(source.error());
    const auto field = admit_field(options->poses_are.field, options->server, options->results);
    if (!field) return status.refuse(field.error());
    const auto input = read_input(*options, *field);
    if (!input) return status.refuse(input.error());
    auto found = calibrate_tip(*input);
    if (!found) return status.refuse(found.error());
    const std::string doubt = tell_doubts(*source, *field, found->verdict);
    print(*found, *input);
    finish_calibration(options->results, tip_text(*found), tip_json(*found, *input), tip_page(*found, *input),
                       found->verdict, status, entry_of(*found, *input, doubt));
  });
}

}  // namespace birdseye::host
