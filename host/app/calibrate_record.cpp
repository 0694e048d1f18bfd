#include <fmt/format.h>

#include <Eigen/Core>
#include <memory>

#include "drivers/system/program.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/files/record_file.hpp"
#include "host/files/write_files.hpp"
#include "host/link/appliance_hardware.hpp"

namespace birdseye::host {

namespace {

using calibration::CalibrationRecord;
using calibration::Identity;
using calibration::Provenance;

struct CalibrateRecordOptions {
  std::filesystem::path record;
  std::string scope, bind;
  bool accept_unsigned = false;
};

/// To what tracker and camera say they are, once both run.
Result<void> bind_to(const std::string& address, CalibrationRecord& record) {
  auto told = ask_hardware(address, {"tracker", "camera"});
  if (!told) return told.error();
  if (auto fits = check_hardware(record, *told); !fits) return fits.error().with_context(address);
  record.tracker = (*told)["tracker"];
  record.camera = (*told)["camera"];
  return {};
}

std::string words_of(const Identity& identity) {
  std::string text;
  for (const auto& [key, value] : identity) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, value);
  return text.empty() ? "not bound to any; see --bind" : text;
}

void show(const char* name, const Provenance& from, const std::string& figures) {
  print_line(fmt::format("{:9} {} ({}, {}; {})", name, figures, name_of(from.grade), from.made_utc, from.made_from));
}

void show(const CalibrationRecord& record) {
  print_line(fmt::format("scope     {}", record.scope.empty() ? "(no name)" : record.scope));
  print_line(fmt::format("tracker   {}", words_of(record.tracker)));
  print_line(fmt::format("camera    {}", words_of(record.camera)));
  if (const auto& lens = record.lens) {
    show("lens", lens->provenance,
         fmt::format("{}x{}, f {:.1f} {:.1f} px, {}, held-out {:.2f} px{}", lens->camera.width_px,
                     lens->camera.height_px, lens->camera.fx_px, lens->camera.fy_px, lens->model, lens->held_out_px,
                     lens->rod_angle_deg ? fmt::format(", rod at {:g} deg", *lens->rod_angle_deg) : ""));
  }
  if (const auto& hand_eye = record.hand_eye) {
    const Eigen::Vector3d t = hand_eye->camera_from_sensor.translation();
    show("hand-eye", hand_eye->provenance,
         fmt::format(
             "at ({:.1f}, {:.1f}, {:.1f}) mm, held-out {:.2f} mm{}", t.x(), t.y(), t.z(), hand_eye->held_out_mm,
             hand_eye->rod ? fmt::format(", rod at {:g} deg, may turn", hand_eye->rod->reference_angle_deg) : ""));
  }
  if (const auto& tip = record.tip) {
    const Eigen::Vector3d& t = tip->tip_in_sensor_mm;
    show("tip", tip->provenance,
         fmt::format("at ({:.1f}, {:.1f}, {:.1f}) mm, RMS {:.2f} mm", t.x(), t.y(), t.z(), tip->rms_mm));
  }
  if (const auto& latency = record.latency) {
    show("latency", latency->provenance,
         fmt::format("{:.2f} ms ({:.2f} to {:.2f}), {:.0f} ppm", latency->offset_ms, latency->ci95_low_ms,
                     latency->ci95_high_ms, latency->drift_ppm));
  }
}

/// As it is, whoever wrote it.
Result<void> show_as_it_is(const CalibrateRecordOptions& options) {
  const auto record = read_record(options.record);
  if (!record) return record.error();
  show(*record);
  return {};
}

/// Who changes a record signs all of it.
Result<void> run(const CalibrateRecordOptions& options) {
  if (options.bind.empty() && options.scope.empty() && !options.accept_unsigned) return show_as_it_is(options);
  const auto authors = Authors::of_this_machine(options.accept_unsigned);
  if (!authors) return authors.error();
  auto read = read_record(options.record, *authors);
  if (!read) return read.error();
  CalibrationRecord* const record = &read->record;
  if (!options.bind.empty()) {
    if (auto bound = bind_to(options.bind, *record); !bound) return bound;
  }
  if (!options.scope.empty()) record->scope = options.scope;
  if (auto written = write_file(options.record, record_text(*record, *authors->machine)); !written) return written;
  show(*record);
  return {};
}

}  // namespace

void add_calibrate_record(CLI::App& calibrate, CommandStatus& status) {
  CLI::App* command = calibrate.add_subcommand("record", "shows a scope's calibration record, names it, binds it");
  const auto options = std::make_shared<CalibrateRecordOptions>();
  command->add_option("record", options->record, "the calibration record")->type_name("FILE")->required();
  command->add_option("--scope", options->scope, "the scope's name or serial number, to be written into it");
  command->add_option("--bind", options->bind, "an appliance whose tracker and camera it holds for")
      ->type_name("[NAME@]HOST:PORT");
  command->add_flag("--accept-unsigned", options->accept_unsigned,
                    "sign also a record that is not signed, or signed by a machine that is not known here");
  command->callback([options, &status] { status.take(run(*options)); });
}

}  // namespace birdseye::host
