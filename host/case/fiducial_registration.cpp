#include "host/case/fiducial_registration.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/base/units.hpp"
#include "host/files/field_files.hpp"
#include "host/files/picture.hpp"
#include "host/files/text_files.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

using calibration::OddPointsVerdict;
using Points = std::vector<Eigen::Vector3d>;

Result<calibration::PointFit<Patient, Tracker>> fit_fiducials(const FiducialFiles& files, FiducialInput& input) {
  const auto named = [&](const Error& error) {
    return error.with_context(fmt::format("{}, {}", files.ct.string(), files.tracker.string()));
  };
  if (!files.match) {
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

/// Root mean square distance from the points' middle.
double spread_of(const Points& points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) middle += point / static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector3d& point : points) sum += (point - middle).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// By the points' shapes: whether one of the two is in metres, or mirrored.
std::string misfit_advice(const FiducialInput& input, double fre_rms_mm) {
  const double ratio = spread_of(input.ct_mm) / spread_of(input.touched_mm);
  const auto near = [](double value) { return value > 900 && value < 1100; };
  if (near(ratio)) return "the touched points seem to be in metres: give mm";
  if (near(1 / ratio)) return "the points of the CT seem to be in metres: give mm";
  Points mirrored = input.touched_mm;
  for (Eigen::Vector3d& point : mirrored) point.x() *= -1;
  const auto fitted = calibration::fit_points<Patient, Tracker>(input.ct_mm, mirrored);
  if (fitted && fitted->fre_rms_mm < 5 && fitted->fre_rms_mm < fre_rms_mm / 4) {
    return "one of the two files is mirrored: one axis has the wrong sign (between 3D Slicer's RAS and LPS, two have)";
  }
  return "are the points in the same order? --match finds it";
}

nlohmann::json rows_of(const Eigen::Matrix4d& m) {
  nlohmann::json rows;
  for (int i = 0; i < 4; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return rows;
}

Result<void> correct_by_field(const FiducialFiles& files, FiducialInput& input) {
  const auto field = read_field_map(files.field);
  if (!field) return field.error();
  CorrectedPlaces touched = corrected_places(field->map, input.touched_mm);
  if (!touched.unmapped.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: {} of {} points lie where the field was not mapped ({}): take them out, and their "
                             "markers of the CT unless --match finds those, or touch markers where it was mapped",
                             files.tracker.string(), touched.unmapped.size(), input.touched_mm.size(),
                             touched.unmapped.front())};
  }
  CorrectedPlaces surface = corrected_places(field->map, input.surface_points_mm);
  if (!surface.unmapped.empty()) {
    input.notes.push_back(fmt::format("{}: {} of {} points lie where the field was not mapped, and are left out",
                                      files.surface_points.string(), surface.unmapped.size(),
                                      input.surface_points_mm.size()));
  }
  input.touched_mm = std::move(touched.places_mm);
  input.surface_points_mm = std::move(surface.places_mm);
  return {};
}

}  // namespace

Result<FiducialInput> read_fiducials(const FiducialFiles& files) {
  FiducialInput input;
  for (const auto& [path, points] : {std::pair{&files.ct, &input.ct_mm},
                                     {&files.tracker, &input.touched_mm},
                                     {&files.targets, &input.targets_mm},
                                     {&files.surface_points, &input.surface_points_mm}}) {
    if (path->empty()) continue;
    auto read = read_points(*path);
    if (!read) return read.error();
    *points = *std::move(read);
  }
  if (!files.field.empty()) {
    if (const auto done = correct_by_field(files, input); !done) return done.error();
  }
  if (!files.volume.path.empty()) {
    auto volume = import_volume(files.volume);
    if (!volume) return volume.error();
    input.volume = *std::move(volume);
  }
  if (!files.surface.empty()) {
    auto surface = read_surface(files.surface);
    if (!surface) return surface.error();
    input.surface = *std::move(surface);
  }
  return input;
}

Result<FiducialsFound> register_fiducials(const FiducialFiles& files, FiducialInput& input) {
  FiducialsFound out;
  auto fitted = fit_fiducials(files, input);
  if (!fitted) return fitted.error();
  out.fit = *std::move(fitted);
  out.localisation = files.localisation_mm
                         ? calibration::LocalisationError{*files.localisation_mm, *files.localisation_mm, 0}
                         : calibration::localisation_error_of(out.fit.fre_rms_mm, input.ct_mm.size());
  out.misfit_advice = misfit_advice(input, out.fit.fre_rms_mm);
  out.odd = calibration::find_odd_points(input.ct_mm, input.touched_mm, files.localisation_mm);
  const calibration::TargetError predicted(input.ct_mm, out.localisation.rms_mm);
  for (const Eigen::Vector3d& target : input.targets_mm) out.tre_mm.push_back(predicted.rms_mm(target));
  if (input.volume) out.range = target_error_range(predicted, *input.volume);
  if (input.surface) {
    auto refined = refine_on_surface(
        *input.surface, input.surface_points_mm,
        {out.fit.to_from, input.touched_mm, out.localisation.rms_mm, out.localisation.degrees_of_freedom});
    if (!refined) return refined.error().with_context(files.surface_points.string());
    out.refinement = *std::move(refined);
  }
  return out;
}

Verdict judge_fiducials(const FiducialsFound& out) {
  Verdict verdict;
  // What a fiducial registration error means for a skin-marker registration of the liver.
  verdict.judge("fiducial registration error", out.fit.fre_rms_mm, "mm", 2, 5,
                out.fit.fre_rms_mm > 5 ? out.misfit_advice : "touch the worst marker again");
  for (std::size_t i = 0; i < out.tre_mm.size(); ++i) {
    verdict.judge(fmt::format("predicted error at target {}", i + 1), out.tre_mm[i], "mm", 3, 5,
                  "place markers round the target");
  }
  const bool wrong = out.odd.verdict == OddPointsVerdict::named || out.odd.verdict == OddPointsVerdict::suspected;
  verdict.add(wrong ? Grade::marginal : Grade::pass, out.odd.told);
  if (out.refinement) verdict.add(out.refinement->accepted ? Grade::pass : Grade::marginal, out.refinement->told);
  return verdict;
}

nlohmann::json fiducials_json(const FiducialInput& input, const FiducialsFound& out, const Verdict& verdict) {
  nlohmann::json json;
  json["fre_rms_mm"] = out.fit.fre_rms_mm;
  json["residuals_mm"] = out.fit.residuals_mm;
  json["leave_one_out_mm"] = out.fit.leave_one_out_mm;
  json["notes"] = input.notes;
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

Picture fiducials_map(const FiducialInput& input, const FiducialsFound& out) {
  return draw_target_error(calibration::TargetError(input.ct_mm, out.localisation.rms_mm),
                           {input.ct_mm, input.targets_mm, input.volume ? &*input.volume : nullptr});
}

}  // namespace birdseye::host
