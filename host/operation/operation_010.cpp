#include "host/operation/operation_010.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <span>

#include "calibration/base/nesting.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "drivers/system/json_file.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/text_files.hpp"
#include "host/operation/finding_checks.hpp"
#include "host/overlay/ct_sha256.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

template <typename T>
std::span<const std::uint8_t> bytes_of(const T* data, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(data), count * sizeof(T)};
}

/// As 0.1.0 counted it: CRC-64 of the voxels, their number and where they lie.
std::string ct_checksum(const Volume& ct) {
  std::uint64_t crc = wire::checksum(bytes_of(ct.hu.data(), ct.hu.size()));
  crc = wire::checksum(bytes_of(ct.size.data(), ct.size.size()), crc);
  const Eigen::Matrix4d place = ct.patient_from_voxel.matrix();
  crc = wire::checksum(bytes_of(place.data(), 16), crc);
  return fmt::format("{:016x}", crc);
}

std::optional<double> figure_of_010(const Json& json, const char* name) {
  return json.contains(name) ? std::optional(json.at(name).get<double>()) : std::nullopt;
}

Instruments instruments_of_010(const Json& found) {
  Instruments out;
  if (found.contains("tracker")) found.at("tracker").get_to(out.tracker);
  if (found.contains("camera")) found.at("camera").get_to(out.camera);
  return out;
}

Error register_anew(const fs::path& folder, const Error& why) {
  return {why.code, fmt::format("{}: {}; register anew", (folder / "operation.json").string(), why.what)};
}

Result<CalibratedScope> calibrated_of_010(const fs::path& folder, const Json& json) {
  auto scope = ScopeSetup::of_files(
      folder / "camera.yaml", folder / "camera_from_sensor.txt",
      {figure_of_010(json, "camera_rms_px"), figure_of_010(json, "held_out_px"), figure_of_010(json, "hand_eye_mm")});
  if (!scope) return scope.error();
  CalibratedScope out{*std::move(scope), json.at("made_utc").get<std::string>(), true, instruments_of_010(json), ""};
  if (auto sound = check_figures(out); !sound) return register_anew(folder, sound.error());
  return out;
}

Result<RegisteredPatient> registered_of_010(const fs::path& folder, const Json& json, const std::string& made_utc) {
  const fs::path path = folder / "patient_from_tracker.txt";
  const auto matrix = read_pose(path);
  if (!matrix) return matrix.error();
  RegisteredPatient out{Transform<Patient, Tracker>::from_matrix(*matrix).inverse(),
                        json.at("fre_mm").get<double>(),
                        {},
                        instruments_of_010(json),
                        made_utc};
  for (const Json& place : json.at("fiducials_in_patient_mm"))
    out.fiducials_in_patient_mm.emplace_back(place.at(0).get<double>(), place.at(1).get<double>(),
                                             place.at(2).get<double>());
  if (auto sound = check_figures(out); !sound) return register_anew(folder, sound.error());
  return out;
}

Result<Operation> operation_of_010(const fs::path& folder, const Json& sheet, const Volume& ct) {
  if (sheet.at("ct_checksum").get<std::string>() != ct_checksum(ct)) {
    return Error{Errc::bad_value, fmt::format("{}: is of another CT, or of this one with its voxels elsewhere; give "
                                              "the CT that the window had",
                                              folder.string())};
  }
  Operation out;
  out.ct_sha256 = ct_sha256(ct);
  sheet.at("made_utc").get_to(out.made_utc);
  if (sheet.contains("calibrated")) {
    auto found = calibrated_of_010(folder, sheet.at("calibrated"));
    if (!found) return found.error();
    out.calibrated = *std::move(found);
  }
  if (sheet.contains("registered")) {
    auto found = registered_of_010(folder, sheet.at("registered"), out.made_utc);
    if (!found) return found.error();
    out.registered = *std::move(found);
  }
  if (sheet.at("deformed").get<bool>()) {
    auto field = read_field(folder / "field.mha");
    if (!field) return field.error();
    DeformedOrgan deformed;
    deformed.field = *std::move(field);
    deformed.seen_rms_mm = figure_of_010(sheet, "deformed_seen_rms_mm");
    const auto rms_mm = figure_of_010(sheet, "deformed_target_rms_mm");
    const auto radius95_mm = figure_of_010(sheet, "deformed_target_radius95_mm");
    if (rms_mm && radius95_mm) deformed.target = {*rms_mm, *radius95_mm};
    deformed.made_utc = out.made_utc;
    if (auto sound = check_figures(deformed); !sound) return register_anew(folder, sound.error());
    out.deformed = std::make_shared<const DeformedOrgan>(std::move(deformed));
  }
  return out;
}

}  // namespace

bool is_of_010(const std::string& text) {
  if (nests_too_deeply(text, Notation::json)) return false;
  const Json json = Json::parse(text, nullptr, false);
  return json.is_object() && json.contains("ct_checksum");
}

Result<Operation> read_operation_010(const fs::path& folder, const Volume& ct) {
  const fs::path path = folder / "operation.json";
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text && text.error().code == Errc::not_found) {
    return Error{Errc::not_found,
                 fmt::format("{}: is not there; give the --out folder of a live of 0.1.0", path.string())};
  }
  if (!text) return text.error();
  if (!is_of_010(*text))
    return Error{Errc::bad_format,
                 fmt::format("{}: is not of 0.1.0, or is damaged: there is nothing to convert", path.string())};
  try {
    return operation_of_010(folder, Json::parse(*text), ct);
  } catch (const Json::exception&) {
    return Error{Errc::bad_format, fmt::format("{}: is damaged: {}; register anew", path.string(), kPartMissing)};
  }
}

}  // namespace birdseye::host
