#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/base/units.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/points/odd_points.hpp"
#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/app/commands.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/surface_refinement.hpp"
#include "host/report/target_error_map.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

using calibration::OddPointsVerdict;
using Points = std::vector<Eigen::Vector3d>;

struct RegisterFiducialsOptions {
  std::filesystem::path ct, tracker, targets, volume, surface, surface_points, out, map, json;
  std::optional<double> localisation_mm;
  bool match = false;
};

/// What was read and asked for.
struct FiducialInput {
  Points ct_mm, touched_mm, targets_mm, surface_points_mm;  ///< ct_mm: in the order of touched_mm once matched
  std::optional<Volume> volume;
  std::optional<Surface> surface;
  std::vector<std::size_t> ct_of_touch;  ///< empty where the files' order holds
};

/// All that was found out.
struct FiducialOutcome {
  calibration::PointFit<Patient, Tracker> fit;
  calibration::LocalisationError localisation;
  calibration::OddPoints odd;
  std::vector<double> tre_mm;
  std::optional<TargetErrorRange> range;
  std::optional<SurfaceRefinement> refinement;
  [[nodiscard]] const Transform<Patient, Tracker>& patient_from_tracker() const {
    return refinement ? refinement->patient_from_tracker : fit.to_from;
  }
};

Result<FiducialInput> read_input(const RegisterFiducialsOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the file to write"};
  if (options.localisation_mm && !(*options.localisation_mm > 0 && *options.localisation_mm < 100))
    return Error{Errc::bad_value, "--fle: is no length in mm over 0"};
  FiducialInput input;
  for (const auto& [path, points] : {std::pair{&options.ct, &input.ct_mm},
                                     {&options.tracker, &input.touched_mm},
                                     {&options.targets, &input.targets_mm},
                                     {&options.surface_points, &input.surface_points_mm}}) {
    if (path->empty()) continue;
    auto read = read_points(*path);
    if (!read) return read.error();
    *points = *std::move(read);
  }
  if (!options.volume.empty()) {
    auto volume = import_volume(options.volume);
    if (!volume) return volume.error();
    input.volume = *std::move(volume);
  }
  if (!options.surface.empty()) {
    auto surface = read_surface(options.surface);
    if (!surface) return surface.error();
    input.surface = *std::move(surface);
  }
  return input;
}

Result<calibration::PointFit<Patient, Tracker>> fit(const RegisterFiducialsOptions& options, FiducialInput& input) {
  const auto named = [&](const Error& error) {
    return Error{error.code, fmt::format("{}, {}: {}", options.ct.string(), options.tracker.string(), error.what)};
  };
  if (!options.match) {
    auto fitted = calibration::fit_points<Patient, Tracker>(input.ct_mm, input.touched_mm);
    if (!fitted && input.ct_mm.size() != input.touched_mm.size())
      return named({fitted.error().code, fitted.error().what + ", or let --match find out which is which"});
    return fitted ? std::move(fitted) : named(fitted.error());
  }
  auto matched = match_and_fit(input.ct_mm, input.touched_mm);
  if (!matched) return named(matched.error());
  Points ordered;
  for (const std::size_t i : matched->ct_of_touch) ordered.push_back(input.ct_mm[i]);
  input.ct_mm = std::move(ordered);
  input.ct_of_touch = std::move(matched->ct_of_touch);
  return std::move(matched->fit);
}

Result<FiducialOutcome> compute(const RegisterFiducialsOptions& options, FiducialInput& input) {
  FiducialOutcome out;
  auto fitted = fit(options, input);
  if (!fitted) return fitted.error();
  out.fit = *std::move(fitted);
  out.localisation = options.localisation_mm
                         ? calibration::LocalisationError{*options.localisation_mm, *options.localisation_mm, 0}
                         : calibration::localisation_error_of(out.fit.fre_rms_mm, input.ct_mm.size());
  out.odd = calibration::find_odd_points(input.ct_mm, input.touched_mm, options.localisation_mm);
  const calibration::TargetError predicted(input.ct_mm, out.localisation.rms_mm);
  for (const Eigen::Vector3d& target : input.targets_mm) out.tre_mm.push_back(predicted.rms_mm(target));
  if (input.volume) out.range = target_error_range(predicted, *input.volume);
  if (input.surface) {
    auto refined = refine_on_surface(
        *input.surface, input.surface_points_mm,
        {out.fit.to_from, input.touched_mm, out.localisation.rms_mm, out.localisation.degrees_of_freedom});
    if (!refined) return refined.error().with_context(options.surface_points.string());
    out.refinement = *std::move(refined);
  }
  return out;
}

Verdict judge(const FiducialOutcome& out) {
  Verdict verdict;
  // What a fiducial registration error means for a skin-marker registration of the liver.
  verdict.judge("fiducial registration error", out.fit.fre_rms_mm, "mm", 2, 5,
                out.fit.fre_rms_mm > 5 ? "are the points in the same order?" : "touch the worst marker again");
  for (std::size_t i = 0; i < out.tre_mm.size(); ++i) {
    verdict.judge(fmt::format("predicted error at target {}", i + 1), out.tre_mm[i], "mm", 3, 5,
                  "place markers round the target");
  }
  const bool wrong = out.odd.verdict == OddPointsVerdict::named || out.odd.verdict == OddPointsVerdict::suspected;
  verdict.add(wrong ? Grade::marginal : Grade::pass, out.odd.told);
  if (out.refinement) verdict.add(out.refinement->accepted ? Grade::pass : Grade::marginal, out.refinement->told);
  return verdict;
}

nlohmann::json rows_of(const Eigen::Matrix4d& m) {
  nlohmann::json rows;
  for (int i = 0; i < 4; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return rows;
}

nlohmann::json json_of(const FiducialInput& input, const FiducialOutcome& out, const Verdict& verdict) {
  nlohmann::json json;
  json["fre_rms_mm"] = out.fit.fre_rms_mm;
  json["residuals_mm"] = out.fit.residuals_mm;
  json["leave_one_out_mm"] = out.fit.leave_one_out_mm;
  json["fle_rms_mm"] = out.localisation.rms_mm;
  json["fle_upper95_mm"] = out.localisation.upper95_mm;
  if (!input.ct_of_touch.empty()) {
    for (const std::size_t i : input.ct_of_touch) json["ct_of_touch"].push_back(i + 1);
  }
  if (!out.tre_mm.empty()) json["tre_mm"] = out.tre_mm;
  if (out.range) {
    json["tre_mm_min"] = out.range->least_mm;
    json["tre_mm_median"] = out.range->median_mm;
    json["tre_mm_p95"] = out.range->p95_mm;
    json["tre_mm_max"] = out.range->most_mm;
  }
  json["outliers"] = json["suspects"] = nlohmann::json::array();
  for (const calibration::OddPoint& p : out.odd.named)
    json["outliers"].push_back(
        {{"name", fmt::format("fiducial {}", p.index + 1)}, {"off_mm", p.off_mm}, {"reason", p.reason}});
  for (const std::size_t i : out.odd.suspects) json["suspects"].push_back(fmt::format("fiducial {}", i + 1));
  if (out.refinement) {
    const SurfaceRefinement& r = *out.refinement;
    json["surface"] = {{"accepted", r.accepted},
                       {"points", r.points},
                       {"kept", r.kept},
                       {"rms_before_mm", r.rms_before_mm},
                       {"rms_after_mm", r.rms_after_mm},
                       {"moved_mm", r.moved_mm},
                       {"allowed_mm", r.allowed_mm},
                       {"turned_deg", r.turned_rad * kDegPerRad},
                       {"patient_from_tracker", rows_of(r.surface_pose.matrix())}};
  }
  json["patient_from_tracker"] = rows_of(out.patient_from_tracker().matrix());
  json["verdict"] = name_of(verdict.grade);
  json["reasons"] = verdict.reasons;
  json["next_steps"] = verdict.next_steps;
  return json;
}

void print(const FiducialInput& input, const FiducialOutcome& out, const Verdict& verdict) {
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    fmt::print("fiducial {:2}", i + 1);
    if (!input.ct_of_touch.empty()) fmt::print(" is CT marker {:2}", input.ct_of_touch[i] + 1);
    fmt::print("  residual {:6.3f} mm", out.fit.residuals_mm[i]);
    if (!out.fit.leave_one_out_mm.empty()) fmt::print("  left out {:6.3f} mm", out.fit.leave_one_out_mm[i]);
    fmt::print("\n");
  }
  fmt::print("FRE {:.4f} mm rms, localisation error {:.2f} mm", out.fit.fre_rms_mm, out.localisation.rms_mm);
  if (out.localisation.degrees_of_freedom > 0) fmt::print(" (95 % sure: under {:.2f} mm)", out.localisation.upper95_mm);
  fmt::print("\n");
  if (out.range) {
    fmt::print("predicted error over the CT: {:.2f} to {:.2f} mm, median {:.2f} mm\n", out.range->least_mm,
               out.range->most_mm, out.range->median_mm);
  }
  for (const calibration::OddPoint& p : out.odd.named) fmt::print("fiducial {} {}\n", p.index + 1, p.reason);
  for (const std::string& reason : verdict.reasons) fmt::print("{}\n", reason);
  for (const std::string& step : verdict.next_steps) fmt::print("next: {}\n", step);
  fmt::print("verdict: {}\n", name_of(verdict.grade));
}

Result<ExitCode> register_fiducials(const RegisterFiducialsOptions& options) {
  auto input = read_input(options);
  if (!input) return input.error();
  const auto out = compute(options, *input);
  if (!out) return out.error();
  const Verdict verdict = judge(*out);
  std::string png;
  if (!options.map.empty()) {
    const Picture picture =
        draw_target_error(calibration::TargetError(input->ct_mm, out->localisation.rms_mm),
                          {input->ct_mm, input->targets_mm, input->volume ? &*input->volume : nullptr});
    png = png_of(picture.view());
  }
  if (auto written = write_files({{options.out, pose_text(out->patient_from_tracker().matrix())},
                                  {options.map, std::move(png)},
                                  {options.json, text_of(json_of(*input, *out, verdict))}});
      !written) {
    return written.error();
  }
  print(*input, *out, verdict);
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_register(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<RegisterFiducialsOptions>();
  CLI::App& reg = *app.add_subcommand("register", "bring a CT and the patient together");
  reg.require_subcommand(1);
  add_register_views(reg, status);
  CLI::App& fiducials = *reg.add_subcommand("fiducials", "rigidly, by corresponding points");
  fiducials.add_option("--ct", options->ct, "markers in the CT: x y z a line, mm, patient frame")->required();
  fiducials.add_option("--tracker", options->tracker, "the same markers as touched, in the same order, tracker frame")
      ->required();
  fiducials.add_flag("--match", options->match, "in any order; the CT may have more markers than were touched");
  fiducials.add_option("--fle", options->localisation_mm,
                       "how well a marker is found and touched, mm rms, if known (default: from the residuals)");
  fiducials.add_option("--targets", options->targets, "points to predict the error at, patient frame");
  fiducials.add_option("--volume", options->volume, "the CT: predicts the error over it, and shows it in the map");
  fiducials.add_option("--map", options->map, "a PNG of the predicted error, in slices through the first target");
  CLI::Option* surface = fiducials.add_option(
      "--surface", options->surface, "refine by this surface: VTK polygons, PLY, STL or OBJ, patient frame, mm");
  CLI::Option* surface_points =
      fiducials.add_option("--surface-points", options->surface_points, "points touched on it, tracker frame");
  surface->needs(surface_points);
  surface_points->needs(surface);
  fiducials.add_option("--out", options->out, "patient_from_tracker, a 4x4 matrix")->required();
  fiducials.add_option("--json", options->json, "write the figures to this file");
  fiducials.callback([options, &status] {
    const auto done = register_fiducials(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
