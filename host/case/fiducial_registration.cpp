#include "host/case/fiducial_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "calibration/base/lower_case.hpp"
#include "calibration/base/units.hpp"
#include "host/files/field_files.hpp"
#include "host/files/named_points.hpp"
#include "host/files/picture.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/points_in_ct.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

using calibration::OddPointsVerdict;
using Points = std::vector<Eigen::Vector3d>;

constexpr double kLeastSpread_mm = 5;  // of markers on a patient
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

struct Unexplained {
  double fre_mm = 0;
  std::size_t points = 0;
};

/// What is left once all that is told for itself is taken out: neither a touch that is named as wrong, nor another
/// scale, nor a mirrored file says how well markers were touched. Of four markers and fewer no touch can be named.
Unexplained unexplained(const FiducialsFound& found) {
  const calibration::PointShape& shape = found.judged.shape;
  const std::size_t all = found.fit.residuals_mm.size();
  Unexplained least{found.fit.fre_rms_mm, all};
  const auto take = [&](double fre_mm, std::size_t points) {
    if (fre_mm < least.fre_mm) least = {fre_mm, points};
  };
  if (!found.odd.named.empty()) take(found.odd.fre_without_rms_mm, all - found.odd.named.size());
  if (found.judged.mirrored) take(shape.mirrored_fre_rms_mm, all);
  if (found.judged.scale != Grade::pass) {
    take(shape.fre_rms_mm, all);
    if (found.judged.along_axis) take(found.judged.axis_fre_rms_mm, all);
  }
  return least;
}

std::string list_of(const std::vector<std::size_t>& indices) {
  std::string text;
  for (std::size_t i = 0; i < indices.size(); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : i + 1 == indices.size() ? " and " : ", ", indices[i] + 1);
  return text;
}

const char* axis_in_words(int axis) {
  return axis == 0 ? "left to right" : axis == 1 ? "front to back" : "head to foot";
}

void judge_shape(Verdict& verdict, const FiducialsFound& out) {
  const FiducialJudgement& judged = out.judged;
  const calibration::PointShape& shape = judged.shape;
  if (out.ct_spread_mm < kLeastSpread_mm) {
    verdict.add(Grade::fail, fmt::format("the markers lie within {:.2g} mm of one another", out.ct_spread_mm),
                "are both files in metres? Give mm");
  }
  if (judged.mirrored) {
    verdict.add(Grade::fail,
                fmt::format("mirrored, the touched points fit the CT's to {:.2f} mm; as they are, to {:.2f} mm",
                            shape.mirrored_fre_rms_mm, shape.fre_rms_mm),
                out.misfit_advice);
  } else if (judged.handedness_open) {
    verdict.add(Grade::marginal,
                fmt::format("the markers lie so nearly in a plane that their mirror image fits as well ({:.2f} mm; as "
                            "they are, {:.2f} mm): whether a file is mirrored cannot be told",
                            shape.mirrored_fre_rms_mm, shape.fre_rms_mm),
                "touch one more marker, off the plane of the others");
  }
  if (judged.scale != Grade::pass && judged.along_axis) {
    verdict.add(judged.scale,
                fmt::format("lengths from {} in the CT are {:.4g} times those that were touched (sigma {:.2g}); along "
                            "the other axes they are not",
                            axis_in_words(shape.axis), shape.axis_scale, shape.axis_scale_sigma),
                axis_scale_advice());
  } else if (judged.scale != Grade::pass) {
    verdict.add(judged.scale,
                fmt::format("lengths in the CT are {:.4g} times those that were touched (sigma {:.2g})", shape.scale,
                            shape.scale_sigma),
                scale_advice(shape.scale));
  }
}

void judge_places(Verdict& verdict, const FiducialsFound& out) {
  constexpr std::string_view kWhere = "outside of the CT, or in the air beside the patient";
  if (!out.judged.outside.empty()) {
    verdict.add(Grade::fail,
                fmt::format("by the CT's file, fiducial{} {} lie{} {}", out.judged.outside.size() > 1 ? "s" : "",
                            list_of(out.judged.outside), out.judged.outside.size() > 1 ? "" : "s", kWhere),
                out.judged.ras
                    ? "the file looks like RAS: with the other sign of x and y all its markers lie in the CT. Give "
                      "LPS (x and y with the other sign), or 3D Slicer's own .mrk.json or .fcsv, which say their frame"
                    : fmt::format("is this the CT that the markers were found in, and are they in mm, patient LPS? "
                                  "The CT has {}",
                                  out.judged.ct_reach));
  }
  if (out.judged.outside.empty() && out.markers_seen) {
    const MarkersSeen& seen = *out.markers_seen;
    if (seen.only_turned()) {
      verdict.add(
          Grade::fail,
          fmt::format("the CT shows a marker at {} of the {} places of the CT's file, and at {} with the other "
                      "sign of x and y",
                      seen.as_given, seen.places, seen.turned),
          "the file looks like RAS: give LPS (x and y with the other sign), or 3D Slicer's own .mrk.json or .fcsv, "
          "which say their frame");
    } else if (seen.none()) {
      verdict.add(seen.turned_inside ? Grade::marginal : Grade::pass,
                  fmt::format("the CT shows no marker of a usual kind at any place of the CT's file{}",
                              seen.turned_inside ? ", and the patient is there with the other sign of x and y too: "
                                                   "nothing tells whether the file is in LPS, or in RAS"
                                                 : ""),
                  "look in --report whether each point lies where its marker is");
    }
  }
  if (!out.targets_outside.empty()) {
    verdict.add(Grade::marginal,
                fmt::format("target{} {} lie{} {}", out.targets_outside.size() > 1 ? "s" : "",
                            list_of(out.targets_outside), out.targets_outside.size() > 1 ? "" : "s", kWhere),
                fmt::format("are the targets in mm, patient LPS? The CT has {}", out.judged.ct_reach));
  }
}

nlohmann::json rows_of(const Eigen::Matrix4d& m) {
  nlohmann::json rows;
  for (int i = 0; i < 4; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return rows;
}

/// Brings the CT's points into the order of the touches of the same names, and leaves names where it did.
Result<void> pair_by_name(const FiducialFiles& files, const std::vector<std::string>& ct_names, FiducialInput& input) {
  const auto index_of = [&](const std::string& name) {
    const auto same = std::find(ct_names.begin(), ct_names.end(), name);
    if (same != ct_names.end()) return static_cast<std::size_t>(same - ct_names.begin());
    const auto alike = [&](const std::string& other) { return lower_case(other) == lower_case(name); };
    const auto one = std::find_if(ct_names.begin(), ct_names.end(), alike);
    if (std::ranges::count_if(ct_names, alike) != 1 || std::ranges::count_if(input.names, alike) != 1)
      return ct_names.size();
    return static_cast<std::size_t>(one - ct_names.begin());
  };
  const auto known = [&](const std::string& name) { return index_of(name) < ct_names.size(); };
  if (files.match || ct_names.empty() || std::none_of(input.names.begin(), input.names.end(), known)) {
    if (!files.match && !ct_names.empty() && !input.names.empty())
      input.notes.push_back("the files have no name in common: their points are paired in the order of the files");
    input.names.clear();
    return {};
  }
  Points ordered;
  ordered.reserve(input.names.size());
  for (const std::string& name : input.names) {
    if (!known(name)) {
      return Error{
          Errc::bad_value,
          fmt::format("{}: \"{}\" is no name of a point in {}, where others are: name it alike, take it out, or "
                      "let --match find out which is which",
                      files.tracker.string(), name, files.ct.string())};
    }
    ordered.push_back(input.ct_mm[index_of(name)]);
  }
  if (const std::size_t left = ct_names.size() - ordered.size(); left > 0)
    input.notes.push_back(
        fmt::format("{} of {} points of {} were not touched", left, ct_names.size(), files.ct.string()));
  input.notes.push_back("points are paired by their names");
  input.ct_mm = std::move(ordered);
  return {};
}

Result<void> correct_by_field(const FiducialFiles& files, FiducialInput& input) {
  const auto authors = Authors::of_this_machine(files.accept_unsigned);
  if (!authors) return authors.error();
  const auto field = read_field_map(files.field, *authors);
  if (!field) return field.error();
  input.field_doubt = field->doubt;
  CorrectedPlaces touched = corrected_places(*field->map, input.touched_mm);
  if (!touched.unmapped.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: {} of {} points lie where the field was not mapped ({}): take them out, and their "
                             "markers of the CT unless --match finds those, or touch markers where it was mapped",
                             files.tracker.string(), touched.unmapped.size(), input.touched_mm.size(),
                             touched.unmapped.front())};
  }
  CorrectedPlaces surface = corrected_places(*field->map, input.surface_points_mm);
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
  std::vector<std::string> ct_names;
  struct Part {
    const std::filesystem::path& path;
    PointsOf of;
    Points& points_mm;
    std::vector<std::string>* names;
  };
  for (const Part& part : {Part{files.ct, PointsOf::patient, input.ct_mm, &ct_names},
                           {files.tracker, PointsOf::tracker, input.touched_mm, &input.names},
                           {files.targets, PointsOf::patient, input.targets_mm, nullptr},
                           {files.surface_points, PointsOf::tracker, input.surface_points_mm, nullptr}}) {
    if (part.path.empty()) continue;
    auto read = read_named_points(part.path, part.of);
    if (!read) return read.error();
    part.points_mm = std::move(read->places_mm);
    if (part.names != nullptr) {
      if (auto sound = refuse_doubles(part.path, part.points_mm, read->names); !sound) return sound.error();
      *part.names = std::move(read->names);
    }
    std::move(read->notes.begin(), read->notes.end(), std::back_inserter(input.notes));
  }
  if (const auto paired = pair_by_name(files, ct_names, input); !paired) return paired.error();
  if (!files.field.empty()) {
    if (const auto done = correct_by_field(files, input); !done) return done.error();
  }
  if (!files.volume.path.empty()) {
    auto imported = import_body(files.volume);
    if (!imported) return imported.error();
    input.volume = std::move(imported->volume);
    std::move(imported->notes.begin(), imported->notes.end(), std::back_inserter(input.notes));
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
  if (auto two = refuse_one_file_twice(files.ct, files.tracker, input.ct_mm, input.touched_mm); !two)
    return two.error();
  out.fit = *std::move(fitted);
  std::optional<double> stated_mm = files.localisation_mm;
  const Volume* const volume = input.volume ? &*input.volume : nullptr;
  out.odd = calibration::find_odd_points(input.ct_mm, input.touched_mm, stated_mm);
  out.judged = judge_fiducial_points(input.ct_mm, input.touched_mm, stated_mm, out.odd, volume);
  if (stated_mm) {
    const Unexplained left = unexplained(out);
    out.times_over_stated = times_over_stated(left.fre_mm, left.points, *stated_mm);
  }
  if (out.times_over_stated) {  // all that rests on it would be too sure
    stated_mm.reset();
    out.odd = calibration::find_odd_points(input.ct_mm, input.touched_mm);
    out.judged = judge_fiducial_points(input.ct_mm, input.touched_mm, stated_mm, out.odd, volume);
  }
  out.localisation = stated_mm ? calibration::LocalisationError{*stated_mm, *stated_mm, 0}
                               : calibration::localisation_error_of(out.fit.fre_rms_mm, input.ct_mm.size());
  const bool by_order = !files.match && input.names.empty();
  if (by_order && out.fit.fre_rms_mm <= kLargestFre_mm)
    out.rival_order_fre_mm = rival_order_fre_mm(input.ct_mm, input.touched_mm);
  if (out.judged.mirrored) out.odd = {};  // of a mirrored file no touch is the wrong one
  out.ct_spread_mm = spread_mm(input.ct_mm);
  out.misfit_advice = misfit_advice(input.ct_mm, input.touched_mm, out.judged);
  const calibration::TargetError predicted(input.ct_mm, out.localisation.rms_mm);
  for (const Eigen::Vector3d& target : input.targets_mm) out.tre_mm.push_back(predicted.rms_mm(target));
  if (input.volume) {
    out.range = target_error_range(predicted, *input.volume);
    out.targets_outside = points_outside(*input.volume, input.targets_mm);
    out.markers_seen = look_for_markers(*input.volume, input.ct_mm);
  }
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
  verdict.judge("fiducial registration error", out.fit.fre_rms_mm, "mm", 2, kLargestFre_mm,
                out.fit.fre_rms_mm > kLargestFre_mm ? out.misfit_advice : "touch the worst marker again");
  // More markers make no fit of points that are none of one another.
  const bool fits = out.fit.fre_rms_mm <= kLargestFre_mm;
  for (std::size_t i = 0; i < out.tre_mm.size(); ++i) {
    verdict.judge(fmt::format("predicted error at target {}", i + 1), out.tre_mm[i], "mm", 3, 5,
                  fits ? "place markers round the target" : "");
  }
  if (out.range && out.tre_mm.empty()) {
    verdict.judge("predicted error over the CT, median", out.range->median_mm, "mm", 3, 5,
                  fits ? "place markers round what will be operated on, and name it with --targets" : "");
  }
  if (out.times_over_stated) {
    verdict.add(Grade::marginal,
                fmt::format("residuals are {:.1f} times what --fle allows: errors are predicted by the residuals",
                            *out.times_over_stated),
                "touch the markers again, or give the --fle that a hand and a CT reach");
  }
  if (out.rival_order_fre_mm) {
    verdict.add(Grade::marginal,
                fmt::format("the markers cannot be told apart by their distances (FRE {:.1f} mm, and {:.1f} mm in "
                            "another order)",
                            out.fit.fre_rms_mm, *out.rival_order_fre_mm),
                "give each point the same name in both files, place the markers less evenly, or touch more");
  }
  judge_shape(verdict, out);
  judge_places(verdict, out);
  const bool wrong = out.odd.verdict == OddPointsVerdict::named || out.odd.verdict == OddPointsVerdict::suspected;
  // Three markers fit whatever one of them is, mirrored or not: the figures above then rest on nothing.
  const bool unchecked = out.fit.residuals_mm.size() == 3;
  verdict.add(wrong || unchecked ? Grade::marginal : Grade::pass, out.odd.told);
  if (unchecked) {
    verdict.add(Grade::marginal, "three markers lie in one plane: whether a file is mirrored cannot be told",
                "touch one of the two off the plane of the three");
  }
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
  if (out.times_over_stated) json["fle_times_over_stated"] = *out.times_over_stated;
  if (out.rival_order_fre_mm) json["rival_order_fre_rms_mm"] = *out.rival_order_fre_mm;
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
  json["names"] = input.names;
  json["scale"] = out.judged.shape.scale;
  json["scale_sigma"] = out.judged.shape.scale_sigma;
  json["axis_scale"] = out.judged.shape.axis_scale;
  json["axis_scale_sigma"] = out.judged.shape.axis_scale_sigma;
  json["axis"] = std::string(1, "xyz"[out.judged.shape.axis]);
  json["mirrored_fre_rms_mm"] = out.judged.shape.mirrored_fre_rms_mm;
  if (input.volume) {
    json["ct_outside"] = json["targets_outside"] = nlohmann::json::array();
    for (const std::size_t i : out.judged.outside) json["ct_outside"].push_back(i + 1);
    for (const std::size_t i : out.targets_outside) json["targets_outside"].push_back(i + 1);
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
                       {"places", r.places},
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
