#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/app/export_lens.hpp"
#include "host/app/overlay_options.hpp"
#include "host/deform/deformed_volume.hpp"
#include "host/deform/transform_file.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/registration_file.hpp"
#include "host/files/result_folder.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/identity_json.hpp"
#include "host/operation/operation.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/texts/texts.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  VolumeSource volume;
  fs::path operation, registration, views, deformation, model_pose, out, json;
  std::string frame = "tracker";
  bool identify = false;
};

/// What registrations found, and the CT.
struct Registered {
  std::optional<Transform<Patient, Tracker>> patient_from_tracker;
  Transform<Patient, Patient> patient_from_model;
  std::optional<DisplacementField> field;
  std::optional<Volume> volume;
  PatientIdentity identity;  ///< of the volume
};

Result<Registered> read_registered(ExportOptions options) {
  Registered read;
  std::error_code ignored;
  if (!options.views.empty()) {
    if (!fs::is_regular_file(options.views / "field.mha", ignored)) {
      return Error{Errc::not_found, fmt::format("{}: holds no field.mha; give the folder that register views wrote",
                                                options.views.string())};
    }
    options.deformation = options.views / "field.mha";
    if (fs::exists(options.views / "pose.txt", ignored)) options.model_pose = options.views / "pose.txt";
  }
  std::optional<Operation> operation;
  std::optional<RegistrationFile> by_file;
  if (!options.operation.empty()) {
    auto kept = read_operation(options.operation);
    if (!kept) return kept.error();
    if (kept->registered) read.patient_from_tracker = kept->registered->tracker_from_patient.inverse();
    if (kept->deformed) read.field = kept->deformed->field;
    operation = *std::move(kept);
  }
  if (!options.registration.empty()) {
    auto registration = read_registration(options.registration);
    if (!registration) return registration.error();
    read.patient_from_tracker = registration->patient_from_tracker;
    by_file = *std::move(registration);
  }
  for (const fs::path* file : {&options.model_pose, &options.deformation}) {
    if (file->empty()) continue;
    if (auto same = check_against_sheet(*file); !same) return same.error();
  }
  if (!options.model_pose.empty()) {
    const auto matrix = read_pose(options.model_pose);
    if (!matrix) return matrix.error();
    read.patient_from_model = Transform<Patient, Patient>::from_matrix(*matrix);
  }
  if (!options.deformation.empty()) {
    auto field = read_field(options.deformation);
    if (!field) return field.error();
    read.field = *std::move(field);
  }
  if (!options.volume.path.empty()) {
    auto imported = import_body(options.volume);
    if (!imported) return imported.error();
    print_notes(imported->notes);
    read.volume = std::move(imported->volume);
    read.identity = std::move(imported->patient);
  }
  if (operation && read.volume) {
    if (auto same = check_patient(*operation, ct_sha256(*read.volume), ""); !same)
      return same.error().with_context("--operation " + options.operation.string());
  }
  if (by_file && read.volume) {
    if (auto same = check_ct(*by_file, ct_sha256(*read.volume)); !same)
      return same.error().with_context(options.registration.string());
    if (by_file->ct_sha256.empty())
      fmt::print("note: {} does not say which CT it is of: that it is of this one, you answer for\n",
                 options.registration.string());
  }
  if (read.field && read.volume) {
    if (auto covers = check_covers(*read.field, *read.volume); !covers)
      return covers.error().with_context(options.deformation.string());
  }
  return read;
}

/// ct_from_seen: of the frame that was asked for.
Result<RestMap> map_of(const ExportOptions& options, const Registered& registered) {
  RestMap map;
  const Transform<Patient, Patient> ct_from_patient = registered.patient_from_model.inverse();
  if (options.frame == "patient") {
    map.ct_from_seen = ct_from_patient.matrix();
  } else if (registered.patient_from_tracker) {
    map.ct_from_seen = (ct_from_patient * *registered.patient_from_tracker).matrix();
  } else {
    return Error{Errc::bad_value,
                 "--frame tracker needs --registration, as register fiducials writes it, or an --operation that was "
                 "registered; or give --frame patient"};
  }
  if (registered.field) map.field = &*registered.field;
  return map;
}

ImageFile image_of(const Volume& volume, const Eigen::Affine3d& seen_from_voxel) {
  ImageFile image;
  image.size = volume.size;
  image.hu = volume.hu;
  image.origin_mm = seen_from_voxel.translation();
  image.spacing_mm = seen_from_voxel.linear().colwise().norm();
  image.axes = seen_from_voxel.linear().colwise().normalized();
  return image;
}

/// Places all over the CT, or the field, as they are seen.
std::vector<Eigen::Vector3d> places(const Registered& registered, const RestMap& map) {
  Eigen::Affine3d ct_from_unit = Eigen::Affine3d(Eigen::Scaling(200.0));
  if (registered.volume) {
    const auto& size = registered.volume->size;
    ct_from_unit = registered.volume->patient_from_voxel * Eigen::Scaling(size[0] - 1.0, size[1] - 1.0, size[2] - 1.0);
  } else if (registered.field) {
    const auto& size = registered.field->size;
    ct_from_unit = registered.field->patient_from_lattice * Eigen::Scaling(size[0] - 1.0, size[1] - 1.0, size[2] - 1.0);
  }
  const Eigen::Affine3d seen_from_ct = Eigen::Affine3d(map.ct_from_seen).inverse();
  constexpr int kSide = 9;
  std::vector<Eigen::Vector3d> points;
  points.reserve(static_cast<std::size_t>(kSide) * kSide * kSide);
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const Eigen::Vector3i cell(n % kSide, n / kSide % kSide, n / (kSide * kSide));
    const Eigen::Vector3d step = cell.cast<double>() + Eigen::Vector3d::Constant(0.5);
    points.emplace_back(seen_from_ct * ct_from_unit * Eigen::Vector3d(step / kSide));
  }
  return points;
}

/// How far ITK, reading the file, takes places from where we do, mm.
Result<double> worst_difference(const fs::path& path, const Registered& registered, const RestMap& map) {
  const std::vector<Eigen::Vector3d> points = places(registered, map);
  const auto mapped = transform_by_file(path, points);
  if (!mapped) return mapped.error();
  double worst_mm = 0;
  for (std::size_t i = 0; i < points.size(); ++i) worst_mm = std::max(worst_mm, ((*mapped)[i] - map(points[i])).norm());
  return worst_mm;
}

ResultFolder folder_of(const ExportOptions& options) {
  return {options.out, "export", "export.json", "ct\\.nrrd|registration\\.h5|rigid\\.tfm|deformation\\.nrrd"};
}

std::vector<fs::path> inputs_of(const ExportOptions& options) {
  return {options.volume.path, options.operation,   options.registration,
          options.views,       options.deformation, options.model_pose};
}

/// Takes away what an earlier export wrote there, and says so.
Result<void> make_empty_of_export(const ExportOptions& options) {
  const auto removed = make_empty(folder_of(options), inputs_of(options));
  if (!removed) return removed.error();
  if (!removed->empty())
    print_notes({fmt::format("{}: replaced an earlier export ({})", options.out.string(), fmt::join(*removed, ", "))});
  return {};
}

Result<ExitCode> run(const ExportOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name a folder"};
  if (options.registration.empty() && options.views.empty() && options.deformation.empty() &&
      options.operation.empty()) {
    return Error{
        Errc::bad_value,
        "give what was registered: --registration of register fiducials, --views of register views, or both; or "
        "the --operation that a live window kept"};
  }
  if (auto is_free = check_free(folder_of(options), inputs_of(options), {options.json}); !is_free)
    return is_free.error();
  const auto registered = read_registered(options);
  if (!registered) return registered.error();
  const auto map = map_of(options, *registered);
  if (!map) return map.error();
  if (auto emptied = make_empty_of_export(options); !emptied) return emptied.error();

  nlohmann::json files = nlohmann::json::object();
  double worst_mm = 0;
  const auto transform = [&](const std::string& name, const RestMap& what, const char* told) -> Result<void> {
    if (auto written = write_transform(options.out / name, what); !written) return written;
    const auto difference = worst_difference(options.out / name, *registered, what);
    if (!difference) return difference.error();
    worst_mm = std::max(worst_mm, *difference);
    files[name] = told;
    return {};
  };
  RestMap rigid = *map;
  rigid.field = nullptr;
  if (auto done = transform("rigid.tfm", rigid, "where the CT lies, undeformed"); !done) return done.error();
  if (auto done = transform("registration.h5", *map, "where the CT lies, deformed if it is"); !done)
    return done.error();
  if (registered->field) {
    if (auto written = write_field(options.out / "deformation.nrrd", *registered->field); !written)
      return written.error();
    files["deformation.nrrd"] = "the deformation alone, in the frame of the CT";
  }
  if (registered->volume) {
    const Volume seen =
        registered->field ? deformed_volume(*registered->volume, *registered->field) : *registered->volume;
    const Eigen::Affine3d seen_from_voxel = Eigen::Affine3d(map->ct_from_seen).inverse() * seen.patient_from_voxel;
    if (auto written = write_image(options.out / "ct.nrrd", image_of(seen, seen_from_voxel), StoredAs::int16); !written)
      return written.error();
    files["ct.nrrd"] = "the CT as it is seen: no transform is to be applied to it";
  }
  Verdict verdict;
  verdict.judge(words("verdict_files"), worst_mm, "mm", 1e-3, 1e-3, words("verdict_files_do"));
  nlohmann::json json = {{"frame", options.frame},
                         {"files", files},
                         {"difference_mm_max", worst_mm},
                         {"verdict", name_of(verdict.grade)},
                         {"reasons", verdict.reasons}};
  if (options.identify) json["patient"] = json_of(registered->identity);
  if (auto written = write_files({{options.out / "export.json", text_of(json)}, {options.json, text_of(json)}});
      !written)
    return written.error();
  for (const auto& [name, told] : files.items())
    fmt::print("{}: {}\n", (options.out / name).string(), told.get<std::string>());
  fmt::print("all in the {} frame\n", options.frame == "tracker" ? "tracker's" : "patient's");
  print_line(fmt::format("verdict: {} ({})", name_of(verdict.grade), verdict.reasons.front()));
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_export(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App& command =
      *app.add_subcommand("export", "the registered, deformed CT for 3D Slicer and other programs on ITK");
  CLI::Option* const operation =
      command.add_option("--operation", options->operation, kOperationHelp)->type_name("FOLDER|FILE");
  command.add_option("--registration", options->registration, "patient_from_tracker, of register fiducials")
      ->excludes(operation);
  CLI::Option* const views =
      command.add_option("--views", options->views, "folder of register views")->excludes(operation);
  command.add_option("--deformation", options->deformation, "a displacement field by itself, LPS mm")
      ->excludes(views)
      ->excludes(operation);
  command.add_option("--model-pose", options->model_pose, "patient_from_model, a 4x4 matrix")
      ->excludes(views)
      ->excludes(operation);
  command.add_option("--volume", options->volume.path, "the CT: exported as it is seen");
  add_ct_options(command, options->volume);
  command.add_option("--frame", options->frame, "where the CT is brought: tracker (default) or patient")
      ->check(CLI::IsMember({"tracker", "patient"}));
  command.add_flag("--identify", options->identify,
                   "name the patient in export.json (default: nothing that is written does)");
  command.add_option("--out", options->out, "folder");
  command.add_option("--json", options->json, "write the figures to this file too");
  const CLI::App* const lens = add_export_lens(command, status);
  command.callback([options, &command, lens, &status] {
    if (command.got_subcommand(lens)) return;
    if (options->out.empty()) return status.refuse({Errc::bad_value, "export: give --out, a folder"});
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
