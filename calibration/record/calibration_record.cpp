#include "calibration/record/calibration_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/base/nesting.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/record/checksum.hpp"
#include "calibration/record/round_field_json.hpp"
#include "calibration/record/sha256.hpp"
#include "calibration/record/strict_json.hpp"

namespace birdseye::calibration {

namespace {

using Json = nlohmann::ordered_json;

template <typename Matrix>
Json rows_of(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    Json row = Json::array();
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
    rows.push_back(row);
  }
  return rows;
}

/// Throws, as the library's own accessors do, what parse_record() turns into an error.
template <typename Matrix>
Matrix matrix_of(const Json& rows) {
  Matrix matrix;
  if (rows.size() != static_cast<std::size_t>(matrix.rows())) throw std::range_error("a matrix of another size");
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    const Json& row = rows.at(static_cast<std::size_t>(r));
    if (row.size() != static_cast<std::size_t>(matrix.cols())) throw std::range_error("a matrix of another size");
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) matrix(r, c) = row.at(static_cast<std::size_t>(c)).get<double>();
  }
  return matrix;
}

template <typename Matrix>
Matrix covariance_of(const Json& rows) {
  Matrix matrix = matrix_of<Matrix>(rows);
  if (!is_covariance(matrix)) throw std::range_error("a covariance that is none");
  return matrix;
}

/// An error that was measured, so none below zero.
void read_error_figure(const Json& json, const char* name, double& figure) {
  json.at(name).get_to(figure);
  if (!is_measured_error(figure))
    throw std::range_error(fmt::format("{} is {:g}, which no measurement gives", name, figure));
}

Json json_of(const Provenance& p) {
  Json json = {
      {"made_utc", p.made_utc}, {"software", p.software}, {"made_from", p.made_from}, {"verdict", name_of(p.grade)}};
  if (!p.doubt.empty()) json["rests_on"] = {{"unsigned", p.doubt}};
  return json;
}
Provenance provenance_of(const Json& json) {
  Provenance p;
  json.at("made_utc").get_to(p.made_utc);
  json.at("software").get_to(p.software);
  json.at("made_from").get_to(p.made_from);
  const auto verdict = json.at("verdict").get<std::string>();
  if (verdict != name_of(Grade::pass) && verdict != name_of(Grade::marginal))
    throw std::range_error("a result whose verdict is \"" + verdict + "\"");
  p.grade = verdict == name_of(Grade::pass) ? Grade::pass : Grade::marginal;
  if (json.contains("rests_on")) json.at("rests_on").at("unsigned").get_to(p.doubt);
  return p;
}

// The parameters of CameraModel in the order of its Jacobians.
constexpr std::pair<const char*, double CameraModel::*> kParameters[] = {
    {"fx_px", &CameraModel::fx_px}, {"fy_px", &CameraModel::fy_px}, {"cx_px", &CameraModel::cx_px},
    {"cy_px", &CameraModel::cy_px}, {"k1", &CameraModel::k1},       {"k2", &CameraModel::k2},
    {"p1", &CameraModel::p1},       {"p2", &CameraModel::p2},       {"k3", &CameraModel::k3}};

Json json_of(const LensEntry& lens) {
  Json json = json_of(lens.provenance);
  json["model"] = lens.model;
  json["width_px"] = lens.camera.width_px;
  json["height_px"] = lens.camera.height_px;
  for (const auto& [name, field] : kParameters) json[name] = lens.camera.*field;
  json["covariance"] = rows_of(lens.covariance);
  json["rms_px"] = lens.rms_px;
  json["held_out_px"] = lens.held_out_px;
  if (lens.rod_angle_deg) json["rod_angle_deg"] = *lens.rod_angle_deg;
  if (lens.round_field) json["round_field"] = json_of_round_field(*lens.round_field);
  return json;
}
LensEntry lens_of(const Json& json) {
  LensEntry lens;
  lens.provenance = provenance_of(json);
  json.at("model").get_to(lens.model);
  json.at("width_px").get_to(lens.camera.width_px);
  json.at("height_px").get_to(lens.camera.height_px);
  for (const auto& [name, field] : kParameters) json.at(name).get_to(lens.camera.*field);
  if (const auto sound = check(lens.camera); !sound) throw std::range_error(sound.error().what);
  lens.covariance = covariance_of<decltype(lens.covariance)>(json.at("covariance"));
  read_error_figure(json, "rms_px", lens.rms_px);
  read_error_figure(json, "held_out_px", lens.held_out_px);
  if (json.contains("rod_angle_deg")) lens.rod_angle_deg = json.at("rod_angle_deg").get<double>();
  if (json.contains("round_field")) lens.round_field = round_field_of_json(json.at("round_field"));
  return lens;
}

Json json_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Vector3d vector_of(const Json& json) {
  const auto v = json.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

Json json_of(const RodEntry& rod) {
  return {{"reference_angle_deg", rod.reference_angle_deg},
          {"axis_in_sensor", json_of(rod.axis_in_sensor)},
          {"axis_point_in_sensor_mm", json_of(rod.axis_point_in_sensor_mm)},
          {"picture_turn", rod.picture_turn}};
}
RodEntry rod_of(const Json& json) {
  RodEntry rod;
  json.at("reference_angle_deg").get_to(rod.reference_angle_deg);
  rod.axis_in_sensor = vector_of(json.at("axis_in_sensor"));
  rod.axis_point_in_sensor_mm = vector_of(json.at("axis_point_in_sensor_mm"));
  json.at("picture_turn").get_to(rod.picture_turn);
  if (!(std::abs(rod.axis_in_sensor.norm() - 1) < 1e-6))
    throw std::range_error("a rod whose axis is not of unit length");
  return rod;
}

Json json_of(const HandEyeEntry& hand_eye) {
  Json json = json_of(hand_eye.provenance);
  json["camera_from_sensor"] = rows_of(hand_eye.camera_from_sensor.matrix());
  json["covariance"] = rows_of(hand_eye.covariance);
  json["rms_px"] = hand_eye.rms_px;
  json["held_out_px"] = hand_eye.held_out_px;
  json["held_out_mm"] = hand_eye.held_out_mm;
  if (hand_eye.rod) json["rod"] = json_of(*hand_eye.rod);
  if (hand_eye.independent_stations) json["independent_stations"] = *hand_eye.independent_stations;
  return json;
}
HandEyeEntry hand_eye_of(const Json& json) {
  HandEyeEntry hand_eye;
  hand_eye.provenance = provenance_of(json);
  const auto matrix = matrix_of<Eigen::Matrix4d>(json.at("camera_from_sensor"));
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0 ||
      matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw std::range_error("a camera_from_sensor that is no rigid transform");
  hand_eye.camera_from_sensor = Transform<Camera, Sensor>::from_matrix(matrix);
  hand_eye.covariance = covariance_of<decltype(hand_eye.covariance)>(json.at("covariance"));
  read_error_figure(json, "rms_px", hand_eye.rms_px);
  read_error_figure(json, "held_out_px", hand_eye.held_out_px);
  read_error_figure(json, "held_out_mm", hand_eye.held_out_mm);
  if (json.contains("rod")) hand_eye.rod = rod_of(json.at("rod"));
  if (json.contains("independent_stations")) {
    hand_eye.independent_stations = json.at("independent_stations").get<int>();
    if (*hand_eye.independent_stations < 1) throw std::range_error("a hand-eye of no stations");
  }
  return hand_eye;
}

Json json_of(const TipEntry& tip) {
  Json json = json_of(tip.provenance);
  json["tip_in_sensor_mm"] = json_of(tip.tip_in_sensor_mm);
  json["covariance_mm2"] = rows_of(tip.covariance_mm2);
  json["rms_mm"] = tip.rms_mm;
  return json;
}
TipEntry tip_of(const Json& json) {
  TipEntry tip;
  tip.provenance = provenance_of(json);
  tip.tip_in_sensor_mm = vector_of(json.at("tip_in_sensor_mm"));
  tip.covariance_mm2 = covariance_of<Eigen::Matrix3d>(json.at("covariance_mm2"));
  read_error_figure(json, "rms_mm", tip.rms_mm);
  return tip;
}

Json json_of(const LatencyEntry& latency) {
  Json json = json_of(latency.provenance);
  json["offset_ms"] = latency.offset_ms;
  json["offset_ci95_ms"] = {latency.ci95_low_ms, latency.ci95_high_ms};
  json["drift_ppm"] = latency.drift_ppm;
  if (latency.camera_delay_ms) json["camera_delay_ms"] = *latency.camera_delay_ms;
  return json;
}
LatencyEntry latency_of(const Json& json) {
  LatencyEntry latency;
  latency.provenance = provenance_of(json);
  json.at("offset_ms").get_to(latency.offset_ms);
  std::tie(latency.ci95_low_ms, latency.ci95_high_ms) = json.at("offset_ci95_ms").get<std::pair<double, double>>();
  json.at("drift_ppm").get_to(latency.drift_ppm);
  if (json.contains("camera_delay_ms")) read_error_figure(json, "camera_delay_ms", latency.camera_delay_ms.emplace());
  if (!(latency.ci95_low_ms <= latency.ci95_high_ms) ||
      !is_measured_error(
          std::max({std::abs(latency.offset_ms), std::abs(latency.ci95_low_ms), std::abs(latency.ci95_high_ms)})))
    throw std::range_error("offset_ms or offset_ci95_ms is what no measurement gives");
  return latency;
}

CalibrationRecord record_of(const Json& json) {
  CalibrationRecord record;
  json.at("scope").get_to(record.scope);
  json.at("hardware").at("tracker").get_to(record.tracker);
  json.at("hardware").at("camera").get_to(record.camera);
  if (json.contains("lens")) record.lens = lens_of(json.at("lens"));
  if (json.contains("hand_eye")) record.hand_eye = hand_eye_of(json.at("hand_eye"));
  if (json.contains("tip")) record.tip = tip_of(json.at("tip"));
  if (json.contains("latency")) record.latency = latency_of(json.at("latency"));
  return record;
}

Json json_of(const CalibrationRecord& record) {
  Json json{{"format", kRecordFormat}, {"version", CalibrationRecord::kVersion}, {"scope", record.scope}};
  json["hardware"] = {{"tracker", record.tracker}, {"camera", record.camera}};
  if (record.lens) json["lens"] = json_of(*record.lens);
  if (record.hand_eye) json["hand_eye"] = json_of(*record.hand_eye);
  if (record.tip) json["tip"] = json_of(*record.tip);
  if (record.latency) json["latency"] = json_of(*record.latency);
  return json;
}

std::string with_checksum(Json json) {
  json[kChecksumKey] = checksum_of(text_of_json(json));
  return text_of_json(json, 2) + "\n";
}

}  // namespace

bool CalibrationRecord::set_lens(LensEntry entry) {
  const bool other = !lens || !(lens->camera == entry.camera);
  lens = std::move(entry);
  if (!other || !hand_eye) return false;
  hand_eye.reset();
  return true;
}

std::string doubt_of(const CalibrationRecord& record) {
  const auto in = [](const char* name, const auto& entry) {
    return entry && !entry->provenance.doubt.empty() ? fmt::format("its {}: {}", name, entry->provenance.doubt) : "";
  };
  for (std::string doubt : {in("lens", record.lens), in("hand-eye", record.hand_eye), in("tip", record.tip),
                            in("latency", record.latency)}) {
    if (!doubt.empty()) return doubt;
  }
  return {};
}

std::string record_text(const CalibrationRecord& record) {
  return with_checksum(json_of(record));
}

std::string record_text(const CalibrationRecord& record, const FileSignature& signature) {
  Json json = json_of(record);
  json[kSignedKey] = json_of_signature(signature);
  return with_checksum(std::move(json));
}

std::string signed_sha256(const CalibrationRecord& record) {
  return sha256_of(text_of_json(json_of(record)));
}

Result<CalibrationRecord> parse_record(const std::string& text) {
  auto read = parse_signed_record(text);
  if (!read) return read.error();
  return std::move(read->record);
}

Result<SignedRecord> parse_signed_record(const std::string& text) {
  Json json = strict_json<Json>(text);
  const bool is_strict = !json.is_discarded();
  if (!is_strict && !nests_too_deeply(text, Notation::json)) json = Json::parse(text, nullptr, false);  // to say why
  if (json.is_discarded() || !json.is_object() || json.value("format", Json()) != kRecordFormat)
    return Error{Errc::bad_format, "is no calibration record, or one that was cut: calibrate again"};
  if (json.value("version", Json()) != CalibrationRecord::kVersion) {
    return Error{Errc::bad_format,
                 fmt::format("is a calibration record of version {}; this program reads version {}",
                             text_of_json(json.value("version", Json())), CalibrationRecord::kVersion)};
  }
  Json told = json;
  told.erase(kChecksumKey);
  const Json checksum = json.value(kChecksumKey, Json());
  if (!checksum.is_string() || !has_checksum(text_of_json(told), checksum.get<std::string>())) {
    return Error{Errc::bad_format,
                 "the calibration record's checksum does not fit: it was damaged or changed by hand; calibrate again"};
  }
  if (!is_strict) {
    return Error{Errc::bad_format,
                 "the calibration record was changed by hand: it says something twice, or goes on behind its end; "
                 "calibrate again"};
  }
  try {
    SignedRecord out{record_of(json), "", std::nullopt, checksum.get<std::string>().starts_with("crc64")};
    if (told.contains(kSignedKey)) out.signature = signature_of_json(told.at(kSignedKey));
    told.erase(kSignedKey);
    out.sha256 = sha256_of(text_of_json(told));
    return out;
  } catch (const std::exception& problem) {
    return Error{Errc::bad_value, fmt::format("the calibration record makes no sense: {}", problem.what())};
  }
}

}  // namespace birdseye::calibration
