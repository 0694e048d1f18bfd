#include "host/operation/operation_parts.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/record/round_field_json.hpp"
#include "host/files/packed_floats.hpp"
#include "host/files/text_files.hpp"
#include "host/operation/finding_checks.hpp"

namespace birdseye::host {

namespace {

using Json = nlohmann::json;

/// Of a lattice: thirty times as many as any that was found has.
constexpr std::size_t kMostPoints = 1U << 20U;

Json rows_of(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    rows.push_back(Json::array());
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) rows.back().push_back(matrix(r, c));
  }
  return rows;
}

template <typename Matrix>
Matrix matrix_of(const Json& rows) {
  Matrix matrix;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c)
      matrix(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
  }
  return matrix;
}

/// Throws, as the library's own accessors do, where it is no whole number that an int holds: else it would be another.
int whole_number_of(const Json& json) {
  const auto refuse = [&json] { throw Json::other_error::create(501, "no whole number of an int", &json); };
  if (!json.is_number_integer()) refuse();
  const bool fits = json.is_number_unsigned() ? json.get<std::uint64_t>() <= std::numeric_limits<int>::max()
                                              : json.get<std::int64_t>() >= std::numeric_limits<int>::min();
  if (!fits) refuse();
  return json.get<int>();
}

std::optional<double> figure_of(const Json& json, const char* name) {
  return json.contains(name) ? std::optional(json.at(name).get<double>()) : std::nullopt;
}

void enter(Json& json, const char* name, const std::optional<double>& figure) {
  if (figure) json[name] = *figure;
}

Json numbers_of(const Eigen::Vector3d& place_mm) {
  return {place_mm.x(), place_mm.y(), place_mm.z()};
}

Eigen::Vector3d place_of(const Json& json) {
  return Eigen::Vector3d(json.get<std::array<double, 3>>().data());
}

Instruments instruments_of(const Json& json) {
  Instruments out;
  json.at("tracker").get_to(out.tracker);
  if (json.contains("camera")) json.at("camera").get_to(out.camera);
  if (json.contains("reference")) json.at("reference").get_to(out.reference);
  return out;
}

}  // namespace

Json json_of(const CalibratedScope& found) {
  const CameraModel& camera = found.scope.camera();
  const CameraVector parameters = parameters_of(camera);
  Json json{{"made_utc", found.made_utc},
            {"made_from", found.by_board ? "board" : "record"},
            {"tracker", found.found_with.tracker},
            {"camera", found.found_with.camera},
            {"lens",
             {{"width_px", camera.width_px},
              {"height_px", camera.height_px},
              {"fx_fy_cx_cy_k1_k2_p1_p2_k3", std::vector<double>(parameters.begin(), parameters.end())}}},
            {"camera_from_sensor", rows_of(found.scope.camera_from_sensor().matrix())}};
  if (!found.scope_name.empty()) json["scope"] = found.scope_name;
  if (!found.record_scope.empty()) json["record_of_scope"] = found.record_scope;
  if (!found.in_place_of_utc.empty()) json["in_place_of_record_utc"] = found.in_place_of_utc;
  if (const auto& covariance = found.scope.camera_covariance()) json["lens"]["covariance"] = rows_of(*covariance);
  if (const auto& field = found.scope.round_field())
    json["lens"]["round_field"] = calibration::json_of_round_field(*field);
  const ScopeFigures& figures = found.scope.figures();
  if (figures.hand_eye_covariance) json["hand_eye_covariance"] = rows_of(*figures.hand_eye_covariance);
  enter(json, "camera_rms_px", figures.camera_rms_px);
  enter(json, "held_out_px", figures.held_out_px);
  enter(json, "held_out_mm", figures.held_out_mm);
  if (found.scope.has_rod() || figures.rod_angle_missing) json["rod"] = "turns, and at which angle it was is not kept";
  if (figures.hand_eye_stations) json["hand_eye_stations"] = *figures.hand_eye_stations;
  return json;
}

Json json_of(const RegisteredPatient& found) {
  Json json{{"made_utc", found.made_utc},
            {"made_from", "touched fiducials"},
            {"tracker", found.found_with.tracker},
            {"tracker_from_patient", rows_of(found.tracker_from_patient.matrix())},
            {"fre_mm", found.fre_mm},
            {"fiducials_in_patient_mm", Json::array()}};
  if (!found.found_with.reference.empty()) json["reference"] = found.found_with.reference;
  if (!found.doubt.empty()) json["doubt"] = found.doubt;
  if (const auto& tip_mm = found.tip_in_pointer_mm) json["tip_in_pointer_mm"] = numbers_of(*tip_mm);
  for (const PlaceOff& place : found.off) {
    json["off"].push_back({{"name", place.name},
                           {"in_ct_mm", numbers_of(place.in_ct_mm)},
                           {"off_mm", place.off_mm},
                           {"deformed", place.deformed},
                           {"refuses", place.refuses}});
  }
  for (const Eigen::Vector3d& place : found.fiducials_in_patient_mm)
    json["fiducials_in_patient_mm"].push_back(numbers_of(place));
  return json;
}

Json json_of(const std::vector<NamedPoint>& picked) {
  Json json{{"picked", Json::array()}};
  for (const NamedPoint& landmark : picked)
    json["picked"].push_back({{"name", landmark.name}, {"in_ct_mm", numbers_of(landmark.place_mm)}});
  return json;
}

Json json_of(const DeformedOrgan& found) {
  const DisplacementField& field = found.field;
  // A vector of three floats is three floats: Eigen adds nothing between them.
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const std::span<const float> values(reinterpret_cast<const float*>(field.displacement_mm.data()),
                                      3 * field.displacement_mm.size());
  Json json{{"made_utc", found.made_utc},
            {"made_from", "views"},
            {"size", field.size},
            {"patient_from_lattice", rows_of(field.patient_from_lattice.matrix())},
            {"displacement_mm_float32_zlib_base64", packed_floats(values)}};
  enter(json, "seen_rms_mm", found.seen_rms_mm);
  if (!found.care.empty()) json["with_care"] = found.care;
  if (found.target) json["target"] = {{"rms_mm", found.target->rms_mm}, {"radius95_mm", found.target->radius95_mm}};
  if (const auto& at_mm = found.target_at_rest_mm; found.target && at_mm)
    json["target"]["at_rest_mm"] = numbers_of(*at_mm);
  return json;
}

Result<CalibratedScope> calibrated_of(const Json& json) {
  const Json& lens = json.at("lens");
  CameraModel camera;
  camera.width_px = whole_number_of(lens.at("width_px"));
  camera.height_px = whole_number_of(lens.at("height_px"));
  const auto parameters = lens.at("fx_fy_cx_cy_k1_k2_p1_p2_k3").get<std::array<double, CameraModel::kParameters>>();
  set_parameters(camera, parameters.data());
  std::optional<CameraMatrix> covariance;
  if (lens.contains("covariance")) covariance = matrix_of<CameraMatrix>(lens.at("covariance"));
  const auto hand_eye = matrix_of<Eigen::Matrix4d>(json.at("camera_from_sensor"));
  if (auto rigid = check_rigid(hand_eye, "camera_from_sensor"); !rigid) return rigid.error();
  ScopeFigures figures{figure_of(json, "camera_rms_px"), figure_of(json, "held_out_px"),
                       figure_of(json, "held_out_mm")};
  if (json.contains("hand_eye_covariance"))
    figures.hand_eye_covariance = matrix_of<Eigen::Matrix<double, 6, 6>>(json.at("hand_eye_covariance"));
  if (json.contains("hand_eye_stations")) figures.hand_eye_stations = whole_number_of(json.at("hand_eye_stations"));
  figures.rod_angle_missing = json.contains("rod");
  auto scope = ScopeSetup::of_values(camera, covariance, Transform<Camera, Sensor>::from_matrix(hand_eye), figures);
  if (!scope) return scope.error();
  if (lens.contains("round_field"))
    scope = scope->with_round_field(calibration::round_field_of_json(lens.at("round_field")));
  CalibratedScope out{*std::move(scope), json.at("made_utc").get<std::string>(),
                      json.at("made_from").get<std::string>() == "board", instruments_of(json),
                      json.value("scope", "")};
  out.record_scope = json.value("record_of_scope", "");
  out.in_place_of_utc = json.value("in_place_of_record_utc", "");
  if (auto sound = check_figures(out); !sound) return sound.error();
  return out;
}

Result<RegisteredPatient> registered_of(const Json& json) {
  const auto matrix = matrix_of<Eigen::Matrix4d>(json.at("tracker_from_patient"));
  if (auto rigid = check_rigid(matrix, "tracker_from_patient"); !rigid) return rigid.error();
  RegisteredPatient out{Transform<Tracker, Patient>::from_matrix(matrix),
                        json.at("fre_mm").get<double>(),
                        {},
                        instruments_of(json),
                        json.at("made_utc").get<std::string>()};
  const Json& places = json.at("fiducials_in_patient_mm");
  out.fiducials_in_patient_mm.reserve(places.size());
  for (const Json& place : places)
    out.fiducials_in_patient_mm.emplace_back(place.at(0).get<double>(), place.at(1).get<double>(),
                                             place.at(2).get<double>());
  out.doubt = json.value("doubt", "");
  if (json.contains("tip_in_pointer_mm")) out.tip_in_pointer_mm = place_of(json.at("tip_in_pointer_mm"));
  for (const Json& place : json.value("off", Json::array())) {
    out.off.push_back({place_of(place.at("in_ct_mm")), place.at("name").get<std::string>(),
                       place.at("off_mm").get<double>(), place.at("deformed").get<bool>(),
                       place.at("refuses").get<bool>()});
  }
  if (auto sound = check_figures(out); !sound) return sound.error();
  return out;
}

Result<std::vector<NamedPoint>> landmarks_of(const Json& json) {
  std::vector<NamedPoint> out;
  for (const Json& landmark : json.at("picked"))
    out.push_back({landmark.at("name").get<std::string>(), place_of(landmark.at("in_ct_mm"))});
  if (auto sound = check_figures(out); !sound) return sound.error();
  return out;
}

Result<DeformedOrgan> deformed_of(const Json& json) {
  DeformedOrgan out;
  json.at("made_utc").get_to(out.made_utc);
  DisplacementField& field = out.field;
  for (std::size_t axis = 0; axis < field.size.size(); ++axis)
    field.size[axis] = whole_number_of(json.at("size").at(axis));
  std::size_t points = 1;
  for (const int count : field.size) {
    if (count < 2 || static_cast<std::size_t>(count) > kMostPoints / points)
      return Error{Errc::bad_value, fmt::format("{} is no size of a lattice", json.at("size").dump())};
    points *= static_cast<std::size_t>(count);
  }
  const auto values = unpacked_floats(json.at("displacement_mm_float32_zlib_base64").get<std::string>(), 3 * points);
  if (!values) return values.error();
  field.displacement_mm.reserve(points);
  for (std::size_t i = 0; i < values->size(); i += 3)
    field.displacement_mm.emplace_back((*values)[i], (*values)[i + 1], (*values)[i + 2]);
  field.patient_from_lattice.matrix() = matrix_of<Eigen::Matrix4d>(json.at("patient_from_lattice"));
  if (auto sound = check_sound(field); !sound) return sound.error();
  out.seen_rms_mm = figure_of(json, "seen_rms_mm");
  out.care = json.value("with_care", "");
  if (json.contains("target")) {
    const Json& target = json.at("target");
    out.target = {target.at("rms_mm").get<double>(), target.at("radius95_mm").get<double>()};
    if (target.contains("at_rest_mm")) out.target_at_rest_mm = place_of(target.at("at_rest_mm"));
  }
  if (auto sound = check_figures(out); !sound) return sound.error();
  return out;
}

}  // namespace birdseye::host
