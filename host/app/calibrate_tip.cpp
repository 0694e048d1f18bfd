#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/points/pivot_verdict.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/tip_phases.hpp"
#include "host/calibrate/tip_pictures.hpp"
#include "host/files/pose_files.hpp"
#include "host/guide/live_poses.hpp"
#include "host/link/appliance_hardware.hpp"

namespace birdseye::host {

namespace {

using calibration::Pivot;
using calibration::PivotPose;
using calibration::SpinAxis;

struct CalibrateTipOptions {
  std::filesystem::path poses, spin;
  std::string transform, reference, phases, unit = "mm";
  std::string server, bird = "pointer";
  double seconds = 20;
  ResultPaths results;
};

/// What was read: poses and set.poses go together.
struct TipInput {
  PoseSet set;
  std::vector<PivotPose> poses;
  std::size_t divots = 1;
  std::optional<PoseSet> spin;
  std::string source;
};

/// What was found out; where there is no pivot the verdict says why.
struct TipOutcome {
  std::optional<Pivot> pivot;
  std::optional<SpinAxis> axis;
  Verdict verdict;
};

Result<PoseSet> read_set(const CalibrateTipOptions& options, const std::filesystem::path& path) {
  const double mm_per_unit = options.unit == "m" ? 1000 : 1;
  return options.reference.empty() ? read_pose_set(path, options.transform, mm_per_unit)
                                   : read_relative_pose_set(path, options.transform, options.reference, mm_per_unit);
}

Result<TipInput> read_input(const CalibrateTipOptions& options) {
  if (options.poses.empty() == options.server.empty())
    return Error{Errc::bad_value, "calibrate tip: give one of --poses and --server"};
  if (!options.server.empty()) {
    if (const auto fits = check_bound_record(options.results.record, options.server, {"tracker"}); !fits)
      return fits.error();
  }
  Progress progress;
  auto set = options.poses.empty() ? collect_poses(options.server, options.bird, options.seconds, progress)
                                   : read_set(options, options.poses);
  if (!set) return set.error();
  TipInput input;
  input.set = *std::move(set);
  input.source = options.poses.empty() ? options.server : options.poses.filename().string();
  if (!options.phases.empty()) {
    const auto phases = parse_phases(options.phases);
    if (!phases) return phases.error();
    auto divots = divots_of(*phases, input.set);
    if (!divots) return divots.error().with_context(options.poses.string());
    std::vector<TimedPose> kept;
    for (std::size_t i = 0; i < divots->size(); ++i) {
      if (!(*divots)[i]) continue;
      kept.push_back(input.set.poses[i]);
      input.poses.push_back({kept.back().tracker_from_sensor, *(*divots)[i], kept.back().time_s});
    }
    input.set.poses = std::move(kept);
    input.divots = phases->size();
  } else {
    for (const TimedPose& pose : input.set.poses) input.poses.push_back({pose.tracker_from_sensor, 0, pose.time_s});
  }
  if (!options.spin.empty()) {
    auto spin = read_set(options, options.spin);
    if (!spin) return spin.error();
    input.spin = *std::move(spin);
  }
  return input;
}

/// A solver's refusal: poses that do not suffice are a verdict, others an error.
Result<void> take_refusal(const Error& error, Verdict& verdict, const char* next_step) {
  if (error.code != Errc::degenerate) return error;
  verdict.add(Grade::fail, error.what, next_step);
  return {};
}

void add_verdict(Verdict& to, const Verdict& more) {
  for (const std::string& reason : more.reasons) to.add(more.grade, reason);
  for (const std::string& step : more.next_steps) to.add(Grade::pass, {}, step);
}

Result<TipOutcome> compute(const TipInput& input) {
  TipOutcome out;
  if (auto pivot = calibration::solve_pivot(input.poses); pivot) {
    out.pivot = *std::move(pivot);
    out.verdict = calibration::judge_pivot(*out.pivot);
  } else if (const auto taken = take_refusal(pivot.error(), out.verdict, "record while the pointer is tilted");
             !taken) {
    return taken.error();
  }
  if (!input.spin) return out;
  std::vector<Transform<Tracker, Sensor>> spun;
  for (const TimedPose& pose : input.spin->poses) spun.push_back(pose.tracker_from_sensor);
  const Eigen::Vector3d tip = out.pivot ? out.pivot->robust.tip_in_sensor_mm : Eigen::Vector3d::UnitZ();
  if (auto axis = calibration::solve_spin_axis(spun, tip); axis) {
    out.axis = *std::move(axis);
    add_verdict(out.verdict, calibration::judge_spin_axis(*out.axis));
  } else if (const auto taken = take_refusal(axis.error(), out.verdict, "record while the pointer is spun"); !taken) {
    return taken.error();
  }
  return out;
}

nlohmann::json json_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json json_of(const std::vector<Eigen::Vector3d>& points) {
  nlohmann::json out = nlohmann::json::array();
  for (const Eigen::Vector3d& point : points) out.push_back(json_of(point));
  return out;
}

nlohmann::json names_of(const std::vector<std::size_t>& indices, const std::vector<TimedPose>& poses) {
  nlohmann::json out = nlohmann::json::array();
  for (const std::size_t i : indices) out.push_back(poses[i].name);
  return out;
}

/// "frame 8: INVALID" as name and reason.
nlohmann::json rejected_json(const PoseSet& set) {
  nlohmann::json out = nlohmann::json::array();
  for (const std::string& text : set.rejected) {
    const auto colon = std::min(text.size(), text.find(": "));
    out.push_back({{"name", text.substr(0, colon)}, {"reason", text.substr(std::min(text.size(), colon + 2))}});
  }
  return out;
}

nlohmann::json json_of(const calibration::PivotFit& fit) {
  return {{"tip_in_sensor_mm", json_of(fit.tip_in_sensor_mm)},
          {"pivot_in_tracker_mm", json_of(fit.pivots_in_tracker_mm[0])},
          {"pivots_in_tracker_mm", json_of(fit.pivots_in_tracker_mm)},
          {"rms_mm", fit.rms_mm},
          {"component_rms_mm", fit.component_rms_mm}};
}

void add_pivot(const Pivot& pivot, const TipInput& input, nlohmann::json& out) {
  out.update(json_of(pivot.robust));
  out["algebraic"] = json_of(pivot.algebraic);
  out["outliers"] = names_of(pivot.outliers, input.set.poses);
  nlohmann::json covariance = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) covariance.push_back(json_of(Eigen::Vector3d(pivot.tip_covariance_mm2.row(i))));
  out["sigma"] = {{"tip_mm", json_of(Eigen::Vector3d(pivot.tip_covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt()))},
                  {"worst_mm", pivot.tip_sigma_mm},
                  {"tip_covariance_mm2", covariance}};
  out["held_out_mm"] = pivot.held_out_mm;
  out["tilt_deg"] = pivot.tilt.widest_deg;
  out["weakest"] = {{"direction_in_sensor", json_of(pivot.tilt.weakest_in_sensor)},
                    {"swing_deg", pivot.tilt.weakest_swing_deg}};
  out["slid"] = {{"mm", pivot.slid_mm}, {"sigma_mm", pivot.slid_sigma_mm}, {"divot", pivot.slid_divot + 1}};
  out["residuals"] = nlohmann::json::array();
  for (std::size_t i = 0; i < input.poses.size(); ++i) {
    out["residuals"].push_back(
        {{"name", input.set.poses[i].name}, {"divot", input.poses[i].divot + 1}, {"mm", pivot.residuals_mm[i]}});
  }
}

nlohmann::json json_of(const TipOutcome& found, const TipInput& input) {
  nlohmann::json out{{"poses", input.poses.size()}, {"rejected", rejected_json(input.set)}, {"notes", input.set.notes}};
  if (found.pivot) add_pivot(*found.pivot, input, out);
  if (found.axis) {
    out["axis"] = {{"axis_in_sensor", json_of(found.axis->axis_in_sensor)},
                   {"sigma_deg", found.axis->sigma_deg},
                   {"wobble_deg", found.axis->wobble_deg},
                   {"turned_deg", found.axis->turned_deg},
                   {"outliers", names_of(found.axis->outliers, input.spin->poses)},
                   {"rejected", rejected_json(*input.spin)}};
  }
  return out;
}

/// Three numbers that read_points takes, and in remarks what they rest on.
std::string tip_text(const TipOutcome& found) {
  if (!found.pivot) return {};
  const Eigen::Vector3d& tip = found.pivot->robust.tip_in_sensor_mm;
  std::string text = fmt::format(
      "# a pointer's tip in the frame of its sensor, mm: x y z\n# verdict {}, standard error "
      "{:.3f} mm, held-out error {:.3f} mm rms\n{:.17g} {:.17g} {:.17g}\n",
      name_of(found.verdict.grade), found.pivot->tip_sigma_mm, found.pivot->held_out_mm, tip.x(), tip.y(), tip.z());
  if (!found.axis) return text;
  const Eigen::Vector3d& axis = found.axis->axis_in_sensor;
  return text + fmt::format("# its shaft, towards the tip: {:.17g} {:.17g} {:.17g} (standard error {:.3f} degrees)\n",
                            axis.x(), axis.y(), axis.z(), found.axis->sigma_deg);
}

std::string xyz_text(const Eigen::Vector3d& v, int digits = 2) {
  return fmt::format("({1:.{0}f}, {2:.{0}f}, {3:.{0}f})", digits, v.x(), v.y(), v.z());
}

std::vector<std::vector<std::string>> figures_table(const Pivot& pivot) {
  const auto row = [](const std::string& name, const calibration::PivotFit& fit) {
    return std::vector<std::string>{name, xyz_text(fit.tip_in_sensor_mm), xyz_text(fit.pivots_in_tracker_mm[0]),
                                    fmt::format("{:.3f}", fit.rms_mm), fmt::format("{:.3f}", fit.component_rms_mm)};
  };
  return {{"", "tip in the sensor's frame, mm", "pivot (the first), mm", "rms, mm", "rms of a coordinate, mm"},
          row("without outliers", pivot.robust),
          row("all poses, algebraic", pivot.algebraic)};
}

std::vector<std::vector<std::string>> odd_poses_table(const TipOutcome& found, const TipInput& input) {
  constexpr std::size_t kRows = 100;
  std::vector<std::vector<std::string>> rows{{"pose", "distance from the pivot, mm", ""}};
  for (const std::size_t i : found.pivot ? found.pivot->outliers : std::vector<std::size_t>{})
    rows.push_back({input.set.poses[i].name, fmt::format("{:.2f}", found.pivot->residuals_mm[i]), "outlier"});
  for (const std::string& text : input.set.rejected) {
    const auto colon = std::min(text.size(), text.find(": "));
    rows.push_back({text.substr(0, colon), "", "rejected" + text.substr(colon)});
  }
  if (rows.size() > kRows) {
    const std::size_t more = rows.size() - kRows;
    rows.resize(kRows);
    rows.push_back({fmt::format("and {} more", more), "", "in the JSON file"});
  }
  return rows;
}

HtmlPage page_of(const TipOutcome& found, const TipInput& input) {
  HtmlPage page("Pointer tip");
  for (const std::string& note : input.set.notes) page.paragraph(note);
  if (found.pivot) {
    page.table(figures_table(*found.pivot));
    page.heading("To which sides the pointer leaned");
    page.svg(
        tilt_coverage_svg(input.poses, *found.pivot),
        "Angle from the mean direction, as seen along it. Shaded: sides to which it leaned by less than 10 degrees.");
    page.heading("Where the tip was");
    page.svg(tip_cloud_svg(*found.pivot),
             "Place of the tip at each pose about its pivot, along the tracker's axes. Dashed: the root mean square "
             "distance. Red: outliers; hollow where they lie outside of the picture.");
    page.heading("How far from its pivot, pose by pose");
    page.svg(tip_residuals_svg(input.poses, *found.pivot),
             "A tip that slides shows as bars that grow or fall in time; a pose that is wrong as one red bar.");
  }
  if (found.axis) {
    page.heading("The shaft");
    page.paragraph(
        fmt::format("Axis of the spin in the sensor's frame {}, standard error {:.2f} degrees, by {} poses "
                    "turned through {:.0f} degrees.",
                    xyz_text(found.axis->axis_in_sensor, 4), found.axis->sigma_deg, found.axis->residuals_deg.size(),
                    found.axis->turned_deg));
  }
  if (const auto rows = odd_poses_table(found, input); rows.size() > 1) {
    page.heading("Poses that were not used");
    page.table(rows);
  }
  return page;
}

void print(const TipOutcome& found, const TipInput& input) {
  constexpr std::size_t kNamed = 12;
  const auto shorten = [](std::vector<std::string> names) {
    const std::size_t count = names.size();
    if (count > kNamed) names.resize(kNamed);
    return fmt::format("{}{}", fmt::join(names, ", "), count > kNamed ? ", ..." : "");
  };
  if (!input.set.rejected.empty())
    fmt::print("{} poses rejected: {}\n", input.set.rejected.size(), shorten(input.set.rejected));
  for (const std::string& note : input.set.notes) fmt::print("{}\n", note);
  if (found.pivot) {
    const Pivot& p = *found.pivot;
    fmt::print("tip in the sensor's frame {} mm, standard error {:.3f} mm\n", xyz_text(p.robust.tip_in_sensor_mm, 3),
               p.tip_sigma_mm);
    if (!p.outliers.empty()) {
      std::vector<std::string> names;
      for (const std::size_t i : p.outliers) names.push_back(input.set.poses[i].name);
      fmt::print("{} of {} poses are outliers: {}\n", names.size(), input.poses.size(), shorten(names));
    }
  }
  if (found.axis) fmt::print("axis in the sensor's frame {}\n", xyz_text(found.axis->axis_in_sensor, 4));
}

/// What a record keeps of it.
RecordEntry entry_of(const TipOutcome& found, const TipInput& input) {
  const std::string made_from =
      fmt::format("{} poses of {} in {} divot(s)", input.set.poses.size(), input.source, input.divots);
  return {made_from, [&found](calibration::CalibrationRecord& record, const calibration::Provenance& provenance) {
            const Pivot& pivot = *found.pivot;
            record.tip = calibration::TipEntry{provenance, pivot.robust.tip_in_sensor_mm, pivot.tip_covariance_mm2,
                                               pivot.robust.rms_mm};
          }};
}

}  // namespace

void add_calibrate_tip(CLI::App& calibrate, CommandStatus& status) {
  const auto options = std::make_shared<CalibrateTipOptions>();
  CLI::App& tip = *calibrate.add_subcommand("tip", "where a pointer's tip is on its sensor, by a pivot");
  tip.add_option("--poses", options->poses,
                 "poses while the tip stands in a divot: a folder of 4x4 matrices, a CSV or a PLUS sequence");
  tip.add_option("--server", options->server, "an appliance that runs: take the poses from it, now")
      ->type_name("HOST:PORT");
  tip.add_option("--bird", options->bird, "the pointer's bird, as the appliance names it (default: pointer)");
  tip.add_option("--seconds", options->seconds, "how long to take poses from it (default: 20)")
      ->check(CLI::Range(2.0, 600.0));
  tip.add_option("--transform", options->transform, "the pointer's, in a sequence of several, as StylusToTracker");
  tip.add_option("--reference", options->reference,
                 "what the divot is fixed to, where it moves too, as ReferenceToTracker");
  tip.add_option("--phases", options->phases,
                 "which frames were in which divot, first-last of each, as 77-162,172-253 (default: all in one)");
  tip.add_option("--spin", options->spin, "poses while the pointer is spun about its shaft: gives its axis, too");
  tip.add_option("--unit", options->unit, "of the lengths in the poses (default: mm)")
      ->check(CLI::IsMember({"mm", "m"}));
  add_result_options(tip, options->results, "the tip, x y z in the sensor's frame, mm");
  tip.callback([options, &status] {
    const auto input = read_input(*options);
    if (!input) return status.refuse(input.error());
    const auto found = compute(*input);
    if (!found) return status.refuse(found.error());
    print(*found, *input);
    finish_calibration(options->results, tip_text(*found), json_of(*found, *input), page_of(*found, *input),
                       found->verdict, status, entry_of(*found, *input));
  });
}

}  // namespace birdseye::host
