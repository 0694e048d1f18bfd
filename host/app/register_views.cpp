#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/record/sha256.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/progress.hpp"
#include "host/app/commands.hpp"
#include "host/app/input_files.hpp"
#include "host/case/error_picture.hpp"
#include "host/case/registration_case.hpp"
#include "host/case/registration_error.hpp"
#include "host/case/registration_report.hpp"
#include "host/case/registration_verdict.hpp"
#include "host/case/run_registration.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/picture.hpp"
#include "host/files/result_folder.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/overlay/frame_painter.hpp"
#include "host/render/engine.hpp"
#include "host/volume/labels.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct RegisterViewsOptions {
  fs::path file, out, json;
};

/// Shift of the organ's centre, and turn.
nlohmann::json motion_json(const Transform<Patient, Patient>& motion, const Eigen::Vector3d& centre_mm) {
  return {{"mm", (motion * centre_mm - centre_mm).norm()},
          {"deg", rotation_log(motion.rotation()).norm() * kDegPerRad}};
}

nlohmann::json pose_json(const ViewRegistration& found) {
  nlohmann::json json = motion_json(found.patient_from_model, found.centre_mm);
  const Eigen::Matrix4d m = found.patient_from_model.matrix();
  for (int i = 0; i < 4; ++i) json["patient_from_model"].push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return json;
}

nlohmann::json expected_json(const std::optional<ExpectedError>& expected) {
  if (!expected) return nullptr;
  return {
      {"rms_mm", expected->rms_mm}, {"radius95_mm", expected->radius95_mm}, {"left_of_prior", expected->left_of_prior}};
}

/// What may be off, by kind of place and of each landmark, beside how far off the landmark is.
void add_expected(nlohmann::json& json, const RegistrationCase& c, const ViewRegistration& found) {
  const ExpectedErrors& expected = *found.expected;
  json["expected_error"] = {{"seen", expected_json(expected.seen)},
                            {"hidden", expected_json(expected.hidden)},
                            {"surface", expected_json(expected.surface)},
                            {"inside", expected_json(expected.inside)},
                            {"target", nullptr}};
  if (c.target_mm && !expected.targets.empty()) json["expected_error"]["target"] = expected_json(expected.targets[0]);
  json["open"] = nlohmann::json::array();
  for (const OpenSide& side : expected.open)
    json["open"].push_back({{"side", side.side}, {"share", side.share}, {"rms_mm", side.rms_mm}});
  if (expected.seen_moved_mm) json["seen_moved_mm"] = *expected.seen_moved_mm;
  const std::size_t first = c.target_mm ? 1 : 0;
  for (std::size_t n = 0; n < c.landmarks.size() && first + n < expected.targets.size(); ++n) {
    const Landmark& landmark = c.landmarks[n];
    nlohmann::json row = expected_json(expected.targets[first + n]);
    row["name"] = landmark.name;
    row["error_mm"] = (found.field.deformed_of(landmark.rest_mm) - landmark.deformed_mm).norm();
    json["landmarks"].push_back(row);
  }
}

/// Root mean square of what is not thought to be wrong; null where there is none of it.
nlohmann::json off_rms_mm(const std::vector<PlaceFit>& fits) {
  double sum_mm2 = 0, count = 0;
  for (const PlaceFit& fit : fits) {
    if (fit.thought_wrong()) continue;
    sum_mm2 += fit.off_mm * fit.off_mm;
    count += 1;
  }
  if (count == 0) return nullptr;
  return std::sqrt(sum_mm2 / count);
}

/// How what else than stereo and outlines tells of the organ fits the result.
void add_further(nlohmann::json& json, const RegistrationCase& c, const ViewRegistration& found) {
  const auto wrong = [](const PlaceFit& fit) { return fit.thought_wrong(); };
  if (!found.touches.empty()) {
    json["surface_points"] = {{"used", found.touches.size()},
                              {"rms_mm", off_rms_mm(found.touches)},
                              {"thought_wrong", std::count_if(found.touches.begin(), found.touches.end(), wrong)}};
  }
  if (found.matched.empty()) return;
  nlohmann::json& matched = json["matched_points"];
  matched = {{"used", found.matched.size()},
             {"rms_mm", off_rms_mm(found.matched)},
             {"thought_wrong", std::count_if(found.matched.begin(), found.matched.end(), wrong)}};
  for (std::size_t n = 0; n < found.matched.size(); ++n) {
    const PlaceFit& fit = found.matched[n];
    matched["each"].push_back({{"name", c.matched[n].name},
                               {"views", c.matched[n].views},
                               {"off_mm", fit.off_mm},
                               {"weight", fit.weight},
                               {"thought_wrong", fit.thought_wrong()}});
  }
}

/// What the matches between the views say of the lens, and of the view that agrees least.
void add_agreement(nlohmann::json& json, const RegistrationCase& c, const ViewAgreement& agreement) {
  json["agreement"] = {{"matches", agreement.matches},
                       {"focal_too_long", agreement.focal.share},
                       {"focal_sigma", agreement.focal.sigma}};
  if (!agreement.odd) return;
  json["agreement"]["odd"] = {{"view", c.views[agreement.odd->view].name},
                              {"eye_off_mm", agreement.odd->off.eye_mm},
                              {"turned_deg", agreement.odd->off.turn_rad * kDegPerRad},
                              {"others_eye_sigma_mm", agreement.odd->others.eye_mm},
                              {"others_angle_sigma_deg", agreement.odd->others.angle_rad * kDegPerRad}};
}

/// By how much the views' poses were off, and by how much each was moved.
void add_poses(nlohmann::json& json, const RegistrationCase& c, const AdjustedPoses& adjusted) {
  json["poses"] = {{"matches", adjusted.matches},
                   {"eye_sigma_mm", adjusted.noise.eye_mm},
                   {"angle_sigma_deg", adjusted.noise.angle_rad * kDegPerRad}};
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    const Transform<Patient, Camera> given = c.views[n].camera_from_patient.inverse();
    const Transform<Patient, Camera> now = adjusted.camera_from_patient[n].inverse();
    json["per_view"][n]["eye_moved_mm"] = (now.translation() - given.translation()).norm();
    json["per_view"][n]["turned_deg"] = rotation_log(given.rotation().transpose() * now.rotation()).norm() * kDegPerRad;
  }
}

/// Of optimisers that compare renderings with the views.
void add_similarity(nlohmann::json& json, const RegistrationCase& c, const ViewRegistration& found) {
  json["similarity"] = c.similarity;
  json["similarity_before"] = found.similarity_before;
  json["similarity_after"] = found.similarity_after;
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    json["per_view"][n]["similarity_before"] = found.per_view_before[n];
    json["per_view"][n]["similarity_after"] = found.per_view_after[n];
  }
  json["gradient_evaluations"] = found.gradient_evaluations;
  json["dof"] = found.parameters.size();
  json["control_points"] = found.control_points;
  json["why_so_many_points"] = found.why_so_many_points;
  json["light"] = {{"offset_in_camera_mm", {found.light.offset_in_camera_mm.x(), found.light.offset_in_camera_mm.y()}},
                   {"falloff", found.light.falloff},
                   {"ambient", found.light.ambient},
                   {"vignette", found.light.vignette}};
  nlohmann::json& points = json["control_displacement_mm"];
  for (std::size_t i = 0; i < found.parameters.size(); i += 3)
    points.push_back({found.parameters[i], found.parameters[i + 1], found.parameters[i + 2]});
}

nlohmann::json json_of(const RegistrationCase& c, const ViewRegistration& found, double time_s) {
  nlohmann::json json = {{"evaluations", found.evaluations},   {"time_s", time_s},
                         {"optimiser", c.optimiser},           {"views", c.views.size()},
                         {"min_jacobian", found.min_jacobian}, {"uncertainty_mm", nullptr}};
  if (found.uncertainty_mm) json["uncertainty_mm"] = *found.uncertainty_mm;
  json["notes"] = c.notes;
  if (found.held_out_gain) {
    json["held_out_gain_nats"] = found.held_out_gain->nats;
    json["held_out_gain_error_nats"] = found.held_out_gain->standard_error_nats;
  }
  if (found.evidence_of_motion_nats) json["evidence_of_motion_nats"] = *found.evidence_of_motion_nats;
  if (found.stereo_points) json["stereo_points"] = *found.stereo_points;
  if (found.expected) add_expected(json, c, found);
  if (found.held_out) {
    json["held_out"] = {{"view", c.views[found.held_out->view].name},
                        {"places", found.held_out->places},
                        {"off_mm", found.held_out->off_mm},
                        {"expected_off_mm", found.held_out->expected_off_mm}};
  }
  if (found.agreement) add_agreement(json, c, *found.agreement);
  add_further(json, c, found);
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    json["per_view"].push_back({{"view", c.views[n].name}});
    if (n < found.outline_off_mm.size() && found.outline_off_mm[n])
      json["per_view"].back()["outline_off_mm"] = *found.outline_off_mm[n];
  }
  if (found.adjusted) add_poses(json, c, *found.adjusted);
  if (!found.per_view_before.empty()) add_similarity(json, c, found);
  if (c.refine_pose) json["pose_correction"] = pose_json(found);
  // Without the true pose, the one that was found is believed.
  Transform<Patient, Patient> error_before, error_after;
  if (c.true_pose) {
    error_before = c.true_pose->inverse();
    error_after = c.true_pose->inverse() * found.patient_from_model;
    json["pose_error_before"] = motion_json(error_before, found.centre_mm);
    json["pose_error_after"] = motion_json(error_after, found.centre_mm);
  }
  const DisplacementField* const initial = c.initial ? &*c.initial : nullptr;
  if (c.truth) {
    json["epsilon_before"] = epsilon(*c.truth, initial);
    json["epsilon_after"] = epsilon(*c.truth, &found.field);
  }
  for (const auto& [key, prefix] : {std::pair{"", ""},
                                    {"surface_", "surface"},
                                    {"hidden_", "hidden"},
                                    {"vessel_", "vessel"},
                                    {"tumour_", "tumour"}}) {
    const auto before = landmark_error(c.landmarks, prefix, initial, error_before);
    const auto after = landmark_error(c.landmarks, prefix, &found.field, error_after);
    if (!before || !after) continue;
    json[fmt::format("{}tre_before_mm_mean", key)] = before->mean_mm;
    json[fmt::format("{}tre_before_mm_max", key)] = before->max_mm;
    json[fmt::format("{}tre_after_mm_mean", key)] = after->mean_mm;
    json[fmt::format("{}tre_after_mm_max", key)] = after->max_mm;
  }
  return json;
}

/// Overlays of every view before and after, and where its grey and the synthetic picture's differ. Lenses and poses are
/// the case's files.
Result<std::vector<FileText>> pictures_of(const RegistrationCase& c, const TransferFunction& transfer,
                                          const ViewRegistration& found) {
  std::optional<Volume> kept;
  if (c.labels) {
    auto cut = keep_labels(c.ct, *c.labels, c.label_values);
    if (!cut) return cut.error();
    kept = *std::move(cut);
  }
  auto engine = make_engine("cpu", kept ? *kept : c.ct, transfer);
  if (!engine) return engine.error();
  std::vector<FileText> files;
  std::vector<ImageRgba> overlays_before;
  OverlayLook look;
  look.opacity = 0.7;
  for (const bool after : {false, true}) {
    if (after) (*engine)->deform(found.field);
    if (!after && c.initial) (*engine)->deform(*c.initial);
    for (std::size_t n = 0; n < c.views.size(); ++n) {
      const VideoView& view = c.views[n];
      Transform<Camera, Patient> camera_from_model = view.camera_from_patient;
      if (after && found.adjusted) camera_from_model = found.adjusted->camera_from_patient[n];
      if (after) camera_from_model = camera_from_model * found.patient_from_model;
      const Still still{c.pictures[n].rgb, view.camera, camera_from_model};
      PaintedStill painted = paint_still(still, **engine, look, vouched_for({}));
      const char* const when = after ? "after" : "before";
      files.push_back({fmt::format("view{}_{}.png", n, when),
                       png_of(RgbView{painted.rgb, view.camera.width_px, view.camera.height_px})});
      files.push_back(
          {fmt::format("view{}_difference_{}.png", n, when),
           png_of(RgbView{difference_picture(view, painted.volume), view.camera.width_px, view.camera.height_px})});
      if (after)
        files.push_back({fmt::format("view{}_outlines.png", n),
                         png_of(outline_picture(c.pictures[n], overlays_before[n], painted.volume).view())});
      else
        overlays_before.push_back(std::move(painted.volume));
    }
  }
  return files;
}

/// What is to be said of places that something else than the views tells of, where some are thought wrong.
struct WrongPlaces {
  std::string told;  ///< empty: none is
  /// Two and a quarter or more, which are no slips of a hand: either they or the views are wrong.
  bool contradict = false;
};

WrongPlaces wrong_of(const std::vector<PlaceFit>& fits, const std::string& what, const char* remedy) {
  std::vector<double> off_mm;
  for (const PlaceFit& fit : fits) {
    if (fit.thought_wrong()) off_mm.push_back(fit.off_mm);
  }
  if (off_mm.empty()) return {};
  const std::size_t wrong = off_mm.size();
  return {fmt::format("{}: {} of {} {} {:.1f} mm (median) off all else and thought to be wrong: {}", what, wrong,
                      fits.size(), wrong == 1 ? "is" : "are", median_of(std::move(off_mm)), remedy),
          wrong >= 2 && 4 * wrong >= fits.size()};
}

ResultFolder folder_of(const RegisterViewsOptions& options) {
  return {options.out, "register views", "result.json",
          "field\\.mha|report\\.html|expected_error\\.png|trace\\.svg|pose\\.txt|"
          "view[0-9]+((_difference)?_(before|after)|_outlines)\\.png",
          "reasons"};
}

std::vector<fs::path> inputs_of(const RegisterViewsOptions& options) {
  std::vector<fs::path> inputs = files_of_case(options.file);
  inputs.push_back(options.file);
  return inputs;
}

/// The organ is not in the pictures where it should be: that is a verdict too.
Result<ExitCode> write_nothing_found(const RegisterViewsOptions& options, const Error& why) {
  if (auto emptied = make_empty(folder_of(options), inputs_of(options)); !emptied) return emptied.error();
  const std::string text =
      text_of({{"verdict", name_of(Grade::fail)}, {"reasons", {why.what}}, {"files", nlohmann::json::array()}});
  if (auto written = write_files({{options.out / "result.json", text}, {options.json, text}}); !written)
    return written.error();
  fmt::print("{}: {}\nverdict: {}\n", options.file.string(), why.what, name_of(Grade::fail));
  return ExitCode::verdict_fail;
}

Result<ExitCode> run(const RegisterViewsOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name a folder"};
  if (auto is_free = check_free(folder_of(options), inputs_of(options), {options.json}); !is_free)
    return is_free.error();
  auto read = read_case(options.file);
  if (!read) return read.error();
  const RegistrationCase& c = *read;
  const auto transfer = load_transfer_function(c.transfer);
  if (!transfer) return transfer.error();

  Progress progress;
  const auto result = run_registration(c, *transfer, true, [&progress](const std::string& line) { progress(line); });
  if (!result && result.error().code == Errc::not_found) return write_nothing_found(options, result.error());
  if (!result) return result.error().with_context(options.file.string());
  const ViewRegistration& found = result->found;
  const double time_s = progress.seconds();

  nlohmann::json json = json_of(c, found, time_s);
  Verdict verdict = verdict_of(c, found);
  const WrongPlaces touches = wrong_of(
      found.touches, fmt::format("{}, [points], places of the surface", options.file.string()),
      "are they in patient LPS and mm, of the organ as it lies in the views, less the tip's radius? Or leave them out");
  const WrongPlaces matched =
      wrong_of(found.matched, fmt::format("{}, landmarks and matched places", options.file.string()),
               "check where they are named in the CT and in the views, or leave them out");
  for (const WrongPlaces& wrong : {touches, matched}) {
    if (wrong.contradict) verdict.add(Grade::marginal, wrong.told);
  }
  json["verdict"] = name_of(verdict.grade);
  json["reasons"] = verdict.reasons;
  if (auto emptied = make_empty(folder_of(options), inputs_of(options)); !emptied) return emptied.error();
  if (auto written = write_field(options.out / "field.mha", found.field); !written) return written.error();
  const std::string pose =
      "# patient_from_model: a deformed place of the model's frame -> the patient frame of the given poses, mm\n" +
      pose_text(found.patient_from_model.matrix());
  const auto field_sum = files_sha256(options.out / "field.mha");
  if (!field_sum) return field_sum.error();
  json["made_utc"] = utc_now();
  json["software"] = "birdseye " BIRDSEYE_VERSION;
  json["sha256"]["field.mha"] = *field_sum;
  if (c.refine_pose) json["sha256"]["pose.txt"] = calibration::sha256_of(pose);
  auto files = pictures_of(c, *transfer, found);
  if (!files) return files.error();
  if (const auto errors = expected_error_picture(c, *result))
    files->push_back({"expected_error.png", png_of(errors->view())});
  files->push_back({"trace.svg", trace_svg(found.trace)});
  files->push_back({"report.html", registration_report(c, found, verdict, json)});
  if (c.refine_pose) files->push_back({"pose.txt", pose});
  json["files"] = nlohmann::json::array({"field.mha"});
  for (const FileText& file : *files) json["files"].push_back(file.path.string());
  files->push_back({"result.json", text_of(json)});
  for (FileText& file : *files) file.path = options.out / file.path;
  files->push_back({options.json, text_of(json)});
  if (auto written = write_files(*files); !written) return written.error();
  progress.keep(fmt::format("{}: {}", (options.out / "report.html").string(), verdict.reasons.front()));
  for (const std::string& note : c.notes) print_line(note);
  for (std::size_t n = 1; n < verdict.reasons.size(); ++n) print_line(verdict.reasons[n]);
  if (!touches.told.empty() && !touches.contradict) print_line(touches.told);
  for (std::size_t n = 0; n < found.matched.size(); ++n) {
    if (!found.matched[n].thought_wrong()) continue;
    print_line(fmt::format("{} is {:.1f} mm off all else and was thought to be wrong: check its places",
                           c.matched[n].name, found.matched[n].off_mm));
  }
  if (json.contains("tre_after_mm_mean")) {
    fmt::print("target error {:.2f} mm before, {:.2f} mm after (mean of {} landmarks)\n",
               json["tre_before_mm_mean"].get<double>(), json["tre_after_mm_mean"].get<double>(), c.landmarks.size());
  }
  fmt::print("verdict: {}\n", name_of(verdict.grade));
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_register_views(CLI::App& reg, CommandStatus& status) {
  const auto options = std::make_shared<RegisterViewsOptions>();
  CLI::App& views = *reg.add_subcommand("views", "by deformation, to several views of a laparoscope");
  views.add_option("--case", options->file, "the case: volume, model and views, a TOML file")->required();
  views.add_option("--out", options->out, "folder for the field, pictures and report")->required();
  views.add_option("--json", options->json, "write the figures to this file");
  views.callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
