#include "host/operation/operation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "drivers/system/durable.hpp"
#include "drivers/system/json_file.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/registration_file.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/operation_010.hpp"
#include "host/operation/operation_parts.hpp"
#include "host/volume/stated_geometry.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSheet = "operation.json";
constexpr const char* kCamera = "camera.yaml";
constexpr const char* kHandEye = "camera_from_sensor.txt";
constexpr const char* kRegistration = "patient_from_tracker.txt";
constexpr const char* kField = "field.mha";

constexpr int kVersion = 2;  // 0.1.0 wrote none

constexpr std::size_t kMostSheet_bytes = 16U << 20U;  // a hundred times what one has

/// Its lens, and how well that is known, where anything says so.
std::string camera_file(const ScopeSetup& scope) {
  const auto& covariance = scope.camera_covariance();
  return camera_text(scope.camera()) + (covariance ? camera_covariance_text(*covariance) : "");
}

nlohmann::json json_of_ct(const Operation& operation) {
  nlohmann::json out{{"sha256", operation.ct_sha256}};
  if (const auto& mm = operation.ct_stated.spacing_mm) out["stated_spacing_mm"] = {mm->x(), mm->y(), mm->z()};
  if (const auto& letters = operation.ct_stated.orientation; !letters.empty()) out["stated_orientation"] = letters;
  return out;
}

StatedGeometry stated_in(const nlohmann::json& ct) {
  StatedGeometry out;
  if (ct.contains("stated_spacing_mm"))
    out.spacing_mm = Eigen::Vector3d(ct.at("stated_spacing_mm").get<std::array<double, 3>>().data());
  out.orientation = ct.value("stated_orientation", "");
  return out;
}

std::string sheet_text(const Operation& operation, const ThisMachine& machine) {
  std::vector<SealedPart> parts{
      {"format", {{"name", kOperationFormat}, {"version", kVersion}}},
      {"made", {{"made_utc", operation.made_utc}, {"software", "birdseye " BIRDSEYE_VERSION}}},
      {"ct", json_of_ct(operation)}};
  if (!operation.labels_sha256.empty()) parts.push_back({"labels", {{"sha256", operation.labels_sha256}}});
  if (!operation.record_sha256.empty()) parts.push_back({"record", {{"sha256", operation.record_sha256}}});
  if (operation.calibrated) parts.emplace_back("calibrated", json_of(*operation.calibrated));
  if (operation.registered) parts.emplace_back("registered", json_of(*operation.registered));
  if (operation.deformed) parts.emplace_back("deformed", json_of(*operation.deformed));
  if (!operation.landmarks.empty()) parts.emplace_back("landmarks", json_of(operation.landmarks));
  if (!operation.doubt.empty()) parts.push_back({"rests_on", {{"unsigned", operation.doubt}}});
  return sealed_text(parts, kOperationFormat, machine);
}

/// A file for other programs, of a part of the operation.
struct Copy {
  const char* name;
  const char* part;
  bool written;  ///< the operation has the part
};

std::array<Copy, 4> copies_of(const Operation& operation) {
  return {{{kCamera, "calibrated", operation.calibrated.has_value()},
           {kHandEye, "calibrated", operation.calibrated.has_value()},
           {kRegistration, "registered", operation.registered.has_value()},
           {kField, "deformed", operation.deformed != nullptr}}};
}

/// Of the operation that the folder holds so far; empty where it holds none that can be read.
std::set<std::string> former_parts(const fs::path& folder) {
  std::set<std::string> parts;
  const auto text = read_whole_file(folder / kSheet, kMostSheet_bytes);
  const auto sheet = text ? unseal(*text) : text.error();
  if (!sheet) return parts;
  for (const auto& [part, value] : sheet->items()) parts.insert(part);
  return parts;
}

/// A file by a copy's name that the former operation did not write is somebody's own.
Result<void> check_copies(const fs::path& folder, const Operation& operation, const std::set<std::string>& former) {
  for (const Copy& copy : copies_of(operation)) {
    std::error_code ignored;
    if (!copy.written || former.contains(copy.part)) continue;
    if (!fs::exists(fs::symlink_status(folder / copy.name, ignored))) continue;
    return Error{Errc::bad_value, fmt::format("{}: is there, and not of this operation; move it away, or give another "
                                              "--out",
                                              (folder / copy.name).string())};
  }
  return {};
}

/// A copy of what is no more in the operation is taken away: it would be taken for the present. For good before the
/// operation is written, for after a power cut a copy that is back would be taken for somebody's own.
Result<void> remove_copies(const fs::path& folder, const Operation& operation, const std::set<std::string>& former) {
  bool removed = false;
  for (const Copy& copy : copies_of(operation)) {
    std::error_code ignored;
    removed = (!copy.written && former.contains(copy.part) && fs::remove(folder / copy.name, ignored)) || removed;
  }
  return removed ? sync_folder(folder) : Result<void>();
}

Result<void> write_copies(const fs::path& folder, const Operation& operation) {
  std::vector<FileText> copies;
  if (const auto& found = operation.calibrated) {
    copies.push_back({folder / kCamera, camera_file(found->scope)});
    copies.push_back({folder / kHandEye, pose_text(found->scope.camera_from_sensor().matrix())});
  }
  if (const auto& found = operation.registered) {
    copies.push_back({folder / kRegistration, registration_text({found->tracker_from_patient.inverse(),
                                                                 operation.ct_sha256, "", found->fre_mm})});
  }
  if (operation.deformed) {
    if (auto written = write_field(folder / kField, operation.deformed->field); !written) return written;
  }
  return write_files(copies);
}

fs::path sheet_of(const fs::path& given) {
  std::error_code ignored;
  return fs::is_directory(given, ignored) ? given / kSheet : given;
}

std::string sha256_in(const nlohmann::json& sheet, const char* part) {
  return sheet.contains(part) ? sheet.at(part).at("sha256").get<std::string>() : "";
}

Result<Operation> operation_of(const nlohmann::json& sheet) {
  Operation out;
  sheet.at("made").at("made_utc").get_to(out.made_utc);
  out.ct_sha256 = sheet.at("ct").at("sha256").get<std::string>();
  out.ct_stated = stated_in(sheet.at("ct"));
  out.labels_sha256 = sha256_in(sheet, "labels");
  out.record_sha256 = sha256_in(sheet, "record");
  if (sheet.contains("calibrated")) {
    auto found = calibrated_of(sheet.at("calibrated"));
    if (!found) return found.error().with_context("calibrated");
    out.calibrated = *std::move(found);
  }
  if (sheet.contains("registered")) {
    auto found = registered_of(sheet.at("registered"));
    if (!found) return found.error().with_context("registered");
    out.registered = *std::move(found);
  }
  if (sheet.contains("deformed")) {
    auto found = deformed_of(sheet.at("deformed"));
    if (!found) return found.error().with_context("deformed");
    out.deformed = std::make_shared<const DeformedOrgan>(*std::move(found));
  }
  if (sheet.contains("landmarks")) {
    auto picked = landmarks_of(sheet.at("landmarks"));
    if (!picked) return picked.error().with_context("landmarks");
    out.landmarks = *std::move(picked);
  }
  if (sheet.contains("rests_on")) sheet.at("rests_on").at("unsigned").get_to(out.doubt);
  return out;
}

}  // namespace

Result<void> write_operation(const fs::path& folder, const Operation& operation, const ThisMachine& machine) {
  const std::set<std::string> former = former_parts(folder);
  if (auto checked = check_copies(folder, operation, former); !checked) return checked;
  // While the former operation still tells that they are its own.
  if (auto removed = remove_copies(folder, operation, former); !removed) return removed;
  if (auto written = write_file(folder / kSheet, sheet_text(operation, machine)); !written) return written;
  return write_copies(folder, operation);
}

bool has_operation(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kSheet, ignored);
}

Result<Operation> read_operation(const fs::path& given, const Authors& authors) {
  auto read = read_signed_operation(given);
  if (!read) return read.error();
  const std::string path = sheet_of(given).string();
  Operation& operation = read->operation;
  auto doubt = authors.admit(kOperationFormat, read->by.sha256, read->by.signature);
  if (!doubt) return doubt.error().with_context(path);
  const auto rests_on = authors.admit_resting_on(operation.doubt);
  if (!rests_on) return rests_on.error().with_context(path);
  if (!doubt->empty()) operation.doubt = *std::move(doubt);
  return std::move(operation);
}

Result<Operation> read_operation(const fs::path& given) {
  auto read = read_signed_operation(given);
  if (!read) return read.error();
  if (auto noted = note_author(sheet_of(given).string(), kOperationFormat, read->by.sha256, read->by.signature); !noted)
    return noted.error();
  note_resting_on(sheet_of(given).string(), read->operation.doubt);
  return std::move(read->operation);
}

Result<SignedOperation> read_signed_operation(const fs::path& given) {
  const fs::path path = sheet_of(given);
  const auto refused = [&path](const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), why)};
  };
  const auto text = read_whole_file(path, kMostSheet_bytes);
  if (!text && text.error().code == Errc::not_found) {
    return Error{Errc::not_found,
                 fmt::format("{}: is not there; give the --out folder of an earlier live", path.string())};
  }
  if (!text) return text.error();
  const auto sheet = unseal(*text);
  if (!sheet && is_of_010(*text)) {
    return refused(
        "was kept by version 0.1.0, which did not bind its files together: whether they were changed since, nobody can "
        "tell. Where you answer for them, `birdseye convert FOLDER --ct CT --out NEW` makes an operation of them; else "
        "register anew");
  }
  if (!sheet) return refused(sheet.error().what + "; give a copy that is as the window wrote it, or register anew");
  try {
    if (sheet->at("format").at("name") != kOperationFormat)
      return refused("is no operation; give the --out folder of a live");
    if (const nlohmann::json& version = sheet->at("format").at("version"); version != kVersion)
      return refused(fmt::format("is of version {}; this program reads version {}", version.dump(), kVersion));
    auto operation = operation_of(*sheet);
    if (!operation) {
      return Error{operation.error().code, fmt::format("{}: {}; register anew", path.string(), operation.error().what)};
    }
    return SignedOperation{*std::move(operation), sealed_by(*text)};
  } catch (const std::exception&) {
    return refused(fmt::format("{}; register anew", kPartMissing));
  }
}

Result<void> check_patient(const Operation& operation, const std::string& ct_sha256, const std::string& labels_sha256) {
  if (operation.ct_sha256 != ct_sha256) {
    const std::vector<std::string> stated = options_of(operation.ct_stated);
    if (stated.empty()) return Error{Errc::bad_value, "is of another CT; give that CT"};
    return Error{
        Errc::bad_value,
        fmt::format("is of another CT, or of this one with its voxels elsewhere; give that CT, and state of it "
                    "what was stated then: {}",
                    fmt::join(stated, " "))};
  }
  if (!operation.labels_sha256.empty() && !labels_sha256.empty() && operation.labels_sha256 != labels_sha256)
    return Error{Errc::bad_value, "is of other labels; give those"};
  return {};
}

Result<void> check_target(const Operation& operation, const Eigen::Vector3d& target_at_rest_mm) {
  if (!operation.deformed || !operation.deformed->target_at_rest_mm) return {};
  const Eigen::Vector3d& then_mm = *operation.deformed->target_at_rest_mm;
  if ((then_mm - target_at_rest_mm).norm() <= kSamePlace_mm) return {};
  return Error{Errc::bad_value,
               fmt::format("says how far the target at {:.1f} {:.1f} {:.1f} may be off, and the target "
                           "is another now; give the same --landmarks or --targets",
                           then_mm.x(), then_mm.y(), then_mm.z())};
}

}  // namespace birdseye::host
