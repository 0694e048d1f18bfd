#include "host/app/export_lens.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "host/files/camera_files.hpp"
#include "host/files/record_file.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct ExportLensOptions {
  std::filesystem::path camera, record, right_camera, right_from_left, out;
  std::string as, name = "scope";
};

Result<CameraModel> lens_of(const ExportLensOptions& options) {
  if (options.camera.empty() == options.record.empty())
    return Error{Errc::bad_value, "export lens: give one of --camera and --record"};
  if (!options.camera.empty()) return read_camera(options.camera);
  const auto record = read_record(options.record);
  if (!record) return record.error();
  if (record->lens) return record->lens->camera;
  return Error{Errc::bad_value,
               options.record.string() + ": holds no lens; birdseye calibrate camera --record enters one"};
}

Result<std::string> text_of_lens(const ExportLensOptions& options) {
  const auto lens = lens_of(options);
  if (!lens) return lens.error();
  const bool pair = !options.right_camera.empty();
  if (pair == options.right_from_left.empty())
    return Error{Errc::bad_value, "give --right-camera and --right-from-left together"};
  if (pair && options.as != "kalibr")
    return Error{Errc::bad_value, fmt::format("--as {}: holds one camera; export the right one by itself", options.as)};
  if (pair) {
    const auto right = read_camera(options.right_camera);
    if (!right) return right.error();
    const auto relation = read_camera_relation(options.right_from_left);
    if (!relation) return relation.error();
    return kalibr_text(*lens, *right, Transform<RightCamera, Camera>::from_matrix(*relation));
  }
  if (options.as == "kalibr") return kalibr_text(*lens);
  return options.as == "ros" ? ros_camera_text(*lens, options.name) : camera_text(*lens);
}

Result<void> run_export_lens(const ExportLensOptions& options) {
  std::error_code ignored;
  if (std::filesystem::exists(options.out, ignored)) {
    return Error{Errc::bad_value, fmt::format("--out {}: is there already; name another file, or remove it first",
                                              options.out.string())};
  }
  const auto text = text_of_lens(options);
  if (!text) return text.error();
  return write_file(options.out, *text);
}

}  // namespace

CLI::App* add_export_lens(CLI::App& parent, CommandStatus& status) {
  const auto options = std::make_shared<ExportLensOptions>();
  CLI::App* const command = parent.add_subcommand("lens", "a lens in another program's format");
  command->add_option("--camera", options->camera, "the lens: a file of OpenCV, ROS or Kalibr (camchain.yaml:cam1)")
      ->type_name("FILE");
  command->add_option("--record,--calibration", options->record, "or a calibration record that holds it")
      ->type_name("FILE");
  command->add_option("--as", options->as, "opencv, ros (camera_info) or kalibr (camchain)")
      ->required()
      ->check(CLI::IsMember({"opencv", "ros", "kalibr"}));
  command->add_option("--name", options->name, "ROS' camera_name (default: scope)");
  command->add_option("--right-camera", options->right_camera, "for kalibr: the right lens, as cam1")
      ->type_name("FILE");
  command->add_option("--right-from-left", options->right_from_left, "4x4 matrix, left to right camera, mm")
      ->type_name("FILE");
  command->add_option("--out", options->out, "the file to write")->required()->type_name("FILE");
  command->callback([options, &status] {
    if (const auto done = run_export_lens(*options); !done) status.refuse(done.error());
  });
  return command;
}

}  // namespace birdseye::host
