#include "host/operation/operation.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "device/wire/igtl_bytes.hpp"
#include "host/files/camera_covariance.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSheet = "operation.json";
constexpr const char* kCamera = "camera.yaml";
constexpr const char* kHandEye = "camera_from_sensor.txt";
constexpr const char* kRegistration = "patient_from_tracker.txt";
constexpr const char* kField = "field.mha";

template <typename T>
std::span<const std::uint8_t> bytes_of(const T* data, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(data), count * sizeof(T)};
}

std::optional<double> figure_of(const nlohmann::json& figures, const char* name) {
  return figures.contains(name) ? std::optional(figures.at(name).get<double>()) : std::nullopt;
}

/// What files of 0.1.0 do not say is not known.
Instruments instruments_of(const nlohmann::json& found) {
  Instruments out;
  if (found.contains("tracker")) found.at("tracker").get_to(out.tracker);
  if (found.contains("camera")) found.at("camera").get_to(out.camera);
  return out;
}

/// A file of 0.1.0 has tracked_rms_px in place of held_out_px: what the fit leaves, which is not the error held out.
/// That one is then not known.
Result<CalibratedScope> read_calibrated(const fs::path& folder, const nlohmann::json& figures) {
  auto scope = ScopeSetup::of_files(
      folder / kCamera, folder / kHandEye,
      {figure_of(figures, "camera_rms_px"), figure_of(figures, "held_out_px"), figure_of(figures, "hand_eye_mm")});
  if (!scope) return scope.error();
  return CalibratedScope{*std::move(scope), figures.at("made_utc").get<std::string>(), true, instruments_of(figures)};
}

nlohmann::json figures_of(const CalibratedScope& found) {
  nlohmann::json out{
      {"made_utc", found.made_utc}, {"tracker", found.found_with.tracker}, {"camera", found.found_with.camera}};
  const ScopeFigures& figures = found.scope.figures();
  if (figures.camera_rms_px) out["camera_rms_px"] = *figures.camera_rms_px;
  if (figures.held_out_px) out["held_out_px"] = *figures.held_out_px;
  if (figures.held_out_mm) out["hand_eye_mm"] = *figures.held_out_mm;
  return out;
}

/// Its lens, and how well that is known, where anything says so.
std::string camera_file(const ScopeSetup& scope) {
  const auto& covariance = scope.camera_covariance();
  return camera_text(scope.camera()) + (covariance ? camera_covariance_text(*covariance) : "");
}

}  // namespace

std::string ct_checksum(const Volume& ct) {
  std::uint64_t crc = wire::checksum(bytes_of(ct.hu.data(), ct.hu.size()));
  crc = wire::checksum(bytes_of(ct.size.data(), ct.size.size()), crc);
  const Eigen::Matrix4d place = ct.patient_from_voxel.matrix();
  crc = wire::checksum(bytes_of(place.data(), 16), crc);
  return fmt::format("{:016x}", crc);
}

Result<void> write_operation(const fs::path& folder, const Operation& operation) {
  std::error_code ignored;
  nlohmann::json sheet{{"made_utc", operation.made_utc}, {"ct_checksum", operation.ct_checksum}};
  std::vector<FileText> files;
  if (const auto& found = operation.calibrated) {
    sheet["calibrated"] = figures_of(*found);
    files.push_back({folder / kCamera, camera_file(found->scope)});
    files.push_back({folder / kHandEye, pose_text(found->scope.camera_from_sensor().matrix())});
  }
  if (const auto& found = operation.registered) {
    sheet["registered"] = {{"fre_mm", found->fre_mm},
                           {"tracker", found->found_with.tracker},
                           {"fiducials_in_patient_mm", nlohmann::json::array()}};
    for (const Eigen::Vector3d& place : found->fiducials_in_patient_mm)
      sheet["registered"]["fiducials_in_patient_mm"].push_back({place.x(), place.y(), place.z()});
    files.push_back({folder / kRegistration, pose_text(found->tracker_from_patient.inverse().matrix())});
  }
  sheet["deformed"] = operation.deformed != nullptr;
  if (const auto& found = operation.deformed) {
    if (found->seen_rms_mm) sheet["deformed_seen_rms_mm"] = *found->seen_rms_mm;
    if (found->target) {
      sheet["deformed_target_rms_mm"] = found->target->rms_mm;
      sheet["deformed_target_radius95_mm"] = found->target->radius95_mm;
    }
    if (auto written = write_field(folder / kField, found->field); !written) return written;
  } else {
    fs::remove(folder / kField, ignored);  // export would take an old one for the present
  }
  if (!operation.registered) fs::remove(folder / kRegistration, ignored);
  files.push_back({folder / kSheet, text_of(sheet)});
  return write_files(files);
}

bool has_operation(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kSheet, ignored);
}

Result<Operation> read_operation(const fs::path& folder) {
  const fs::path path = folder / kSheet;
  std::ifstream in(path);
  if (!in) {
    return Error{Errc::not_found,
                 fmt::format("{}: is not there; give the --out folder of an earlier live", path.string())};
  }
  try {
    const nlohmann::json sheet = nlohmann::json::parse(in);
    Operation out;
    sheet.at("made_utc").get_to(out.made_utc);
    sheet.at("ct_checksum").get_to(out.ct_checksum);
    if (sheet.contains("calibrated")) {
      auto found = read_calibrated(folder, sheet.at("calibrated"));
      if (!found) return found.error();
      out.calibrated = *std::move(found);
    }
    if (sheet.contains("registered")) {
      const auto matrix = read_pose(folder / kRegistration);
      if (!matrix) return matrix.error();
      out.registered = {Transform<Patient, Tracker>::from_matrix(*matrix).inverse(),
                        sheet.at("registered").at("fre_mm").get<double>(),
                        {},
                        instruments_of(sheet.at("registered"))};
      for (const auto& place : sheet.at("registered").at("fiducials_in_patient_mm"))
        out.registered->fiducials_in_patient_mm.emplace_back(place.at(0).get<double>(), place.at(1).get<double>(),
                                                             place.at(2).get<double>());
      if (out.registered->fiducials_in_patient_mm.size() < 3)
        return Error{Errc::bad_format,
                     fmt::format("{}: names fewer than three fiducials; register anew", path.string())};
    }
    if (sheet.at("deformed").get<bool>()) {
      auto field = read_field(folder / kField);
      if (!field) return field.error();
      const auto rms_mm = figure_of(sheet, "deformed_target_rms_mm");
      const auto radius95_mm = figure_of(sheet, "deformed_target_radius95_mm");
      std::optional<MotionError> target;
      if (rms_mm && radius95_mm) target = {*rms_mm, *radius95_mm};
      out.deformed = std::make_shared<const DeformedOrgan>(
          DeformedOrgan{*std::move(field), figure_of(sheet, "deformed_seen_rms_mm"), target});
    }
    return out;
  } catch (const nlohmann::json::exception& wrong) {
    return Error{Errc::bad_format, fmt::format("{}: is damaged, or of an earlier version ({}); register anew",
                                               path.string(), wrong.what())};
  }
}

}  // namespace birdseye::host
