#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration/record/field_map_file.hpp"
#include "drivers/identity/this_machine.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/program.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/calibrate_field_check.hpp"
#include "host/app/pose_options.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/field_pictures.hpp"
#include "host/files/field_files.hpp"
#include "host/files/pose_collector.hpp"
#include "host/link/appliance_hardware.hpp"

namespace birdseye::host {

namespace {

using calibration::FieldFit;

struct CalibrateFieldOptions {
  std::filesystem::path grid, poses;
  std::vector<std::filesystem::path> pair;
  std::string grid_spec, kind = "auto";
  std::optional<double> distance_mm;
  bool held_alike = false;
  std::string bind;
  std::vector<std::string> tools;
  PoseOptions poses_are;
  ResultPaths results;
};

struct Fitted {
  FieldFit fit;
  std::vector<std::string> rejected;
  std::string made_from;
};

Result<Fitted> fit_pairs(const CalibrateFieldOptions& options, const std::optional<calibration::FieldBasis>& basis) {
  const PoseReading how = pose_reading(options.poses_are, std::nullopt);
  PoseFile a{options.pair[0], how}, b{options.pair[1], how};
  if (options.tools.size() == 1)
    return Error{Errc::bad_value, "--tool: with --pair give it twice, for the first file and for the second"};
  if (!options.tools.empty()) {
    a.how.transform = options.tools[0];
    b.how.transform = options.tools[1];
  }
  auto pairs = read_field_pairs(a, b);
  if (!pairs) return pairs.error();
  auto fit = calibration::fit_field_from_pairs(pairs->pairs, {basis, options.distance_mm});
  if (!fit) return fit.error().with_context(options.pair[0].string());
  return Fitted{*std::move(fit), std::move(pairs->rejected),
                fmt::format("{} pairs of poses of two sensors on one body", pairs->pairs.size())};
}

Result<Fitted> fit_places(const CalibrateFieldOptions& options, const std::optional<calibration::FieldBasis>& basis) {
  const auto read = [&]() -> Result<FieldSamples> {
    PoseReading how = pose_reading(options.poses_are, std::nullopt);
    if (!options.grid.empty()) return read_field_grid(options.grid, options.held_alike, how.mm_per_unit);
    if (options.tools.size() > 1) return Error{Errc::bad_value, "--tool: with --poses give it once"};
    if (!options.tools.empty()) how.transform = options.tools[0];
    const auto spec = parse_grid_spec(options.grid_spec);
    if (!spec) return spec.error();
    return read_field_poses(options.poses, *spec, options.held_alike, how);
  };
  auto samples = read();
  if (!samples) return samples.error();
  auto fit = calibration::fit_field(samples->samples, {basis});
  if (!fit) {
    const auto& path = options.grid.empty() ? options.poses : options.grid;
    return fit.error().with_context(path.string());
  }
  return Fitted{*std::move(fit), std::move(samples->rejected),
                fmt::format("{} places of a board", samples->samples.size())};
}

/// Refuses, by its name, what was given and would be of no effect.
Result<void> check_use(const CLI::App& field, const CalibrateFieldOptions& options) {
  if (options.poses.empty()) {
    if (auto fine = refuse_given(field, {"--grid-spec"}, "goes with --poses"); !fine) return fine;
  }
  if (!options.grid.empty()) {
    if (auto fine = refuse_given(field, {"--tool", "--time-unit", "--column-major", "--poses-are"},
                                 "goes with --poses or --pair");
        !fine)
      return fine;
  }
  if (options.pair.empty()) return refuse_given(field, {"--distance"}, "goes with --pair");
  return refuse_given(field, {"--held-alike"}, "goes with --grid or --poses");
}

Result<Fitted> fit(const CLI::App& field, const CalibrateFieldOptions& options) {
  const int inputs = (options.grid.empty() ? 0 : 1) + (options.poses.empty() ? 0 : 1) + (options.pair.empty() ? 0 : 1);
  if (inputs != 1)
    return Error{Errc::bad_value, "calibrate field: give one of --grid, --poses with --grid-spec, and --pair"};
  if (const auto used = check_use(field, options); !used) return used.error();
  const auto basis = calibration::field_basis_of(options.kind);
  return options.pair.empty() ? fit_places(options, basis) : fit_pairs(options, basis);
}

nlohmann::json json_of(const Fitted& fitted) {
  const FieldFit& fit = fitted.fit;
  const auto& box = fit.map.data().functions;
  nlohmann::json json{{"held_out_mm", fit.held_out_mm},
                      {"worst_mm", fit.held_out_worst_mm},
                      {"worst", fit.worst},
                      {"before_mm", fit.before_mm},
                      {"before_worst_mm", fit.before_worst_mm},
                      {"kind", name_of(fit.chosen.basis)},
                      {"order", fit.chosen.order},
                      {"smoothing", fit.chosen.smoothing},
                      {"mapped_percent", 100 * fit.mapped_part},
                      {"sigma95_mm", fit.sigma95_mm ? nlohmann::json(*fit.sigma95_mm) : nlohmann::json()},
                      {"orientation_mapped", fit.map.maps_orientation()},
                      {"measurements", fit.residuals.size()},
                      {"not_counted", std::ranges::count_if(fit.residuals, [](const auto& r) { return r.beyond; })},
                      {"rejected", fitted.rejected},
                      {"candidates", nlohmann::json::array()},
                      {"outliers", nlohmann::json::array()}};
  const Eigen::Vector3d &l = box.low_mm, &h = box.high_mm;
  json["box_mm"] = {{l.x(), l.y(), l.z()}, {h.x(), h.y(), h.z()}};
  for (const auto& c : fit.candidates)
    json["candidates"].push_back({{"kind", name_of(c.basis)}, {"order", c.order}, {"held_out_mm", c.held_out_mm}});
  for (const auto& r : fit.residuals) {
    if (r.outlier)
      json["outliers"].push_back(
          {{"name", r.name}, {"off_mm", r.held_out_mm.norm()}, {"not_mapped", r.beside_outlier}});
  }
  if (fit.held_out_deg) {
    json["before_deg"] = *fit.before_deg;
    json["held_out_deg"] = *fit.held_out_deg;
  }
  if (fit.from_pairs) {
    json["sensor_distance_mm"] = fit.a_from_b_mm->norm();
    json["direction_spread"] = fit.direction_spread;
  } else {
    json["scale_percent"] = 100 * (fit.scale - 1);
    const Eigen::Vector3d along = 100 * (fit.stretch.array() - 1);
    json["scale_percent_along"] = {along.x(), along.y(), along.z()};
    if (const auto& level = fit.shifted_level) {
      const Eigen::Vector3d& by = level->shift_mm;
      json["shifted_level"] = {{"axis", std::string(1, "xyz"[level->axis])},
                               {"level", level->level},
                               {"at_mm", level->at_mm},
                               {"by_mm", {by.x(), by.y(), by.z()}}};
    }
  }
  return json;
}

HtmlPage page_of(const Fitted& fitted) {
  const FieldFit& fit = fitted.fit;
  HtmlPage page("The tracker's field");
  page.paragraph(
      fmt::format("Made from {}. Held out means: a region's measurements corrected by a map that was not "
                  "shown that region.",
                  fitted.made_from));
  page.table({{"", "before", "after, held out"},
              {"error, RMS", fmt::format("{:.2f} mm", fit.before_mm), fmt::format("{:.2f} mm", fit.held_out_mm)},
              {"largest", fmt::format("{:.2f} mm", fit.before_worst_mm),
               fmt::format("{:.2f} mm, {}", fit.held_out_worst_mm, fit.worst)}});
  if (fit.held_out_deg)
    page.paragraph(
        fmt::format("Orientation: {:.2f} deg RMS before, {:.2f} deg after.", *fit.before_deg, *fit.held_out_deg));
  page.heading("Where it is off");
  page.svg(field_arrows_svg(fit),
           "Slices through the volume, x to the right and y up, in the tracker's frame. Grey: "
           "not mapped, poses there are doubted. Crosses: outliers.");
  page.heading("Which map");
  page.svg(field_candidates_svg(fit),
           "Held-out error of each kind, with the noise of the measurements in it. Dark: the "
           "one that is used.");
  std::vector<std::vector<std::string>> odd{{"measurement", "off", ""}};
  for (const auto& r : fit.residuals) {
    if (r.outlier) odd.push_back({r.name, fmt::format("{:.1f} mm", r.held_out_mm.norm()), "outlier, not used"});
  }
  for (const std::string& why : fitted.rejected) odd.push_back({why, "", "rejected"});
  if (odd.size() > 1) {
    page.heading("Not used");
    page.table(odd);
  }
  return page;
}

Result<std::string> signed_text(const calibration::FieldMap& map, const calibration::FieldMapNotes& notes) {
  const auto machine = ThisMachine::open();
  if (!machine) return machine.error();
  return field_map_text(map, notes, machine->sign(calibration::kFieldMapFormat, signed_sha256(map, notes)));
}

void run(const CLI::App& field, const CalibrateFieldOptions& options, CommandStatus& status) {
  std::vector<std::filesystem::path> sources = options.pair;
  sources.push_back(options.poses);
  const auto source = admit_sources(sources, options.results);
  if (!source) return status.refuse(source.error());
  calibration::Identity tracker;
  if (!options.bind.empty()) {
    auto told = ask_hardware(options.bind, {"tracker"});
    if (!told) return status.refuse(told.error());
    tracker = (*told)["tracker"];
  }
  auto fitted = fit(field, options);
  if (!fitted) return status.refuse(fitted.error());
  for (const std::string& line : by_kind(fitted->rejected)) print_line(fmt::format("rejected {}", line));
  Verdict verdict = verdict_of(fitted->fit);
  if (const std::string doubt = tell_doubts(*source, {}, verdict); !doubt.empty()) fitted->made_from += "; " + doubt;
  fmt::print("{} of order {}: {:.2f} mm before, {:.2f} mm after, held out\n", name_of(fitted->fit.chosen.basis),
             fitted->fit.chosen.order, fitted->fit.before_mm, fitted->fit.held_out_mm);
  const calibration::FieldMapNotes notes{
      utc_now(),     "birdseye " BIRDSEYE_VERSION, fitted->made_from,
      verdict.grade, fitted->fit.held_out_mm,      calibration::field_of_tracker(tracker)};
  ResultPaths results = options.results;
  Result<std::string> text = std::string();
  if (!results.out.empty() && verdict.grade != Grade::fail) text = signed_text(fitted->fit.map, notes);
  if (!text) results.out.clear();  // what was found is not lost for it
  finish_calibration(results, text ? *text : "", json_of(*fitted), page_of(*fitted), verdict, status);
  if (!text) status.refuse(text.error().with_context(options.results.out.string()));
}

}  // namespace

void add_calibrate_field(CLI::App& calibrate, CommandStatus& status) {
  auto options = std::make_shared<CalibrateFieldOptions>();
  CLI::App* field =
      calibrate.add_subcommand("field", "map how metal bends the tracker's field, and check it day by day");
  field->add_option("--grid", options->grid, "a table true_x,true_y,true_z,x,y,z[,qx,qy,qz,qw] (CSV)")
      ->type_name("FILE");
  field->add_option("--poses", options->poses, "poses at the nodes of --grid-spec, in their order")->type_name("PATH");
  field->add_option("--grid-spec", options->grid_spec, "counts and steps, x fastest: 6x6x5:100x96x100mm")
      ->type_name("SPEC");
  field->add_option("--pair", options->pair, "poses of two sensors on one rigid body, recorded together")
      ->expected(2)
      ->type_name("A B");
  field
      ->add_option("--tool,--transform", options->tools,
                   "whose poses, where a file holds those of several tools; twice with --pair")
      ->expected(1, 2);
  add_unit_options(*field, options->poses_are);
  field->add_option("--distance", options->distance_mm, "between the centres of the pair's sensors, mm")
      ->check(CLI::Range(1.0, 10'000.0));
  field->add_flag("--held-alike", options->held_alike,
                  "the sensor was turned the same way at each place: orientation is mapped too");
  field->add_option("--kind", options->kind, "which functions; auto: those with the least held-out error")
      ->check(CLI::IsMember({"auto", "polynomial", "bernstein", "rbf"}));
  field
      ->add_option("--bind", options->bind,
                   "an appliance whose tracker the field is of; with another one birdseyed uses no pose")
      ->type_name("[NAME@]HOST:PORT");
  add_result_options(*field, options->results, "the map, for [calibration] field of birdseyed (JSON)", false);
  field->add_flag("--accept-unsigned", options->results.accept_unsigned,
                  "go on also from a recording that is not signed, or signed by a machine that is not known here");
  CLI::App* check = add_calibrate_field_check(*field, status);
  field->callback([options, field, check, &status] {
    if (!field->got_subcommand(check)) run(*field, *options, status);
  });
}

}  // namespace birdseye::host
