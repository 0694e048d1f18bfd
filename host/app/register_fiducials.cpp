#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibration/base/verdict.hpp"
#include "calibration/record/sha256.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/app/results.hpp"
#include "host/case/fiducial_registration.hpp"
#include "host/case/fiducial_report.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/registration_file.hpp"
#include "host/files/write_files.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

struct RegisterFiducialsOptions {
  FiducialFiles files;
  std::filesystem::path out, map, json, report;
};

void print(const FiducialInput& input, const FiducialsFound& out, const Verdict& verdict) {
  for (const std::string& note : input.notes) print_line(note);
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    std::string line = fmt::format("fiducial {:2}", i + 1);
    if (!input.names.empty()) line += fmt::format(" ({})", input.names[i]);
    if (!input.ct_of_touch.empty()) line += fmt::format(" is CT marker {:2}", input.ct_of_touch[i] + 1);
    line += fmt::format("  residual {:6.3f} mm", out.fit.residuals_mm[i]);
    if (!out.fit.leave_one_out_mm.empty()) line += fmt::format("  left out {:6.3f} mm", out.fit.leave_one_out_mm[i]);
    print_line(line);
  }
  fmt::print("FRE {:.4f} mm rms, localisation error {:.2f} mm", out.fit.fre_rms_mm, out.localisation.rms_mm);
  if (out.localisation.degrees_of_freedom > 0) fmt::print(" (95 % sure: under {:.2f} mm)", out.localisation.upper95_mm);
  fmt::print("\n");
  if (out.range) {
    fmt::print("predicted error over the CT: {:.2f} to {:.2f} mm, median {:.2f} mm\n", out.range->least_mm,
               out.range->most_mm, out.range->median_mm);
  }
  for (const calibration::OddPoint& p : out.odd.named) print_line(fmt::format("fiducial {} {}", p.index + 1, p.reason));
  for (const std::string& reason : verdict.reasons) print_line(reason);
  for (const std::string& step : verdict.next_steps) print_line(fmt::format("next: {}", step));
  fmt::print("verdict: {}\n", name_of(verdict.grade));
}

Result<ExitCode> run(const RegisterFiducialsOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the file to write"};
  if (const auto& fle_mm = options.files.localisation_mm; fle_mm && !(*fle_mm > 0 && *fle_mm < 100))
    return Error{Errc::bad_value, "--fle: is no length in mm over 0"};
  auto input = read_fiducials(options.files);
  if (!input) return input.error();
  const auto out = register_fiducials(options.files, *input);
  if (!out) return out.error();
  Verdict verdict = judge_fiducials(*out);
  if (const std::string& doubt = input->field_doubt; !doubt.empty())
    verdict.add(Grade::marginal, words("why_unsigned", words("unsigned_field"), doubt));
  const bool failed = verdict.grade == Grade::fail;
  const std::string pose = registration_text(
      {out->patient_from_tracker(), input->volume ? ct_sha256(*input->volume) : "", utc_now(), out->fit.fre_rms_mm});
  nlohmann::json json = fiducials_json(*input, *out, verdict);
  json["made_utc"] = utc_now();
  json["software"] = "birdseye " BIRDSEYE_VERSION;
  if (!failed) json["sha256"]["out"] = calibration::sha256_of(pose);
  for (const auto& [name, path] : {std::pair{"ct", options.files.ct}, {"tracker", options.files.tracker}}) {
    const auto sum = files_sha256(path);
    if (!sum) return sum.error();
    json["sha256"][name] = *sum;
  }
  if (auto written =
          write_files({{failed ? std::filesystem::path() : options.out, pose},
                       {options.map, options.map.empty() ? "" : png_of(fiducials_map(*input, *out).view())},
                       {options.report, options.report.empty() ? "" : fiducials_page(*input, *out, verdict).html()},
                       {options.json, text_of(json)}});
      !written) {
    return written.error();
  }
  print(*input, *out, verdict);
  if (!failed) return ExitCode::success;
  tell_not_written(options.out);
  return ExitCode::verdict_fail;
}

}  // namespace

void add_register(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<RegisterFiducialsOptions>();
  CLI::App& reg = *app.add_subcommand("register", "bring a CT and the patient together");
  reg.require_subcommand(1);
  add_register_views(reg, status);
  CLI::App& fiducials = *reg.add_subcommand("fiducials", "rigidly, by corresponding points");
  fiducials
      .add_option("--ct", options->files.ct,
                  "markers in the CT, patient frame: x y z a line, mm (also names), 3D Slicer's .mrk.json or .fcsv, "
                  "MITK's .mps")
      ->required();
  fiducials
      .add_option("--tracker", options->files.tracker,
                  "the same markers as touched, tracker frame, in the same order or with the same names")
      ->required();
  fiducials.add_flag("--match", options->files.match, "in any order; the CT may have more markers than were touched");
  fiducials.add_option("--fle", options->files.localisation_mm,
                       "how well a marker is found and touched, mm rms, if known (default: from the residuals)");
  fiducials.add_option("--targets", options->files.targets, "points to predict the error at, patient frame");
  fiducials.add_option(
      "--volume", options->files.volume.path,
      "the CT: says whether the points lie in it, predicts the error over it, and shows it in the map");
  add_ct_options(fiducials, options->files.volume);
  fiducials.add_option("--map", options->map, "a PNG of the predicted error, in slices through the first target")
      ->check(png_name);
  CLI::Option* surface = fiducials.add_option(
      "--surface", options->files.surface, "refine by this surface: VTK polygons, PLY, STL or OBJ, patient frame, mm");
  CLI::Option* surface_points =
      fiducials.add_option("--surface-points", options->files.surface_points, "points touched on it, tracker frame");
  CLI::Option* const field =
      fiducials
          .add_option("--field", options->files.field,
                      "correct touched points by this map of the tracker's field (birdseye calibrate field)")
          ->type_name("MAP");
  fiducials
      .add_flag("--accept-unsigned", options->files.accept_unsigned,
                "go on also from a map that is not signed, or signed by a machine that is not known here")
      ->needs(field);
  surface->needs(surface_points);
  surface_points->needs(surface);
  fiducials.add_option("--out", options->out, "patient_from_tracker, a 4x4 matrix")->required();
  fiducials.add_option("--json", options->json, "write the figures to this file");
  fiducials.add_option("--report", options->report, "a page with the figures and pictures (HTML)");
  fiducials.callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
