#include "host/operation/replay_setup.hpp"

#include <fmt/format.h>

#include "calibration/record/calibration_record.hpp"
#include "host/files/record_file.hpp"
#include "host/files/text_files.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/touch_detector.hpp"

namespace birdseye::host {

namespace {

using calibration::CalibrationRecord;
using Clock = std::chrono::steady_clock;

/// Calls take with every event but the pixels.
template <typename Take>
Result<void> look_through(const ReplayInputs& inputs, const Take& take) {
  const auto reader =
      RecordingReader::open(inputs.recording, {.speed = 0, .transform = inputs.transform, .pictures = false});
  if (!reader) return reader.error();
  for (;;) {
    const auto event = (*reader)->next(Clock::now());
    if (!event && event.error().code == Errc::disconnected) return {};
    if (!event) return event.error();
    if (*event) take(**event);
  }
}

/// The record that was in force when it was recorded, if one was.
Result<std::optional<CalibrationRecord>> record_of(const ReplayInputs& inputs) {
  if (!inputs.calibration.empty()) {
    auto record = read_record(inputs.calibration);
    if (!record) return record.error();
    return std::optional(*std::move(record));
  }
  std::string text;
  const auto looked = look_through(inputs, [&text](const wire::Event& event) {
    const auto* told = std::get_if<wire::Calibration>(&event);
    if (told != nullptr && told->in_force) text = told->record;
  });
  if (!looked) return looked.error();
  if (text.empty()) return std::optional<CalibrationRecord>();
  auto record = calibration::parse_record(text);
  if (!record) {
    return Error{record.error().code,
                 fmt::format("{}: its calibration record {}", inputs.recording.string(), record.error().what)};
  }
  return std::optional(*std::move(record));
}

template <typename To, typename From>
Result<Transform<To, From>> read_transform(const std::filesystem::path& path) {
  const auto matrix = read_pose(path);
  if (!matrix) return matrix.error();
  return Transform<To, From>::from_matrix(*matrix);
}

Result<void> take_calibration(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record,
                              ReplaySetup& out) {
  if (inputs.camera.empty() != inputs.camera_from_sensor.empty())
    return Error{Errc::bad_value, "--camera and --camera-from-sensor go together; give both, or --calibration"};
  if (!inputs.camera.empty()) {
    auto camera = read_camera(inputs.camera);
    if (!camera) return camera.error();
    auto hand_eye = read_transform<Camera, Sensor>(inputs.camera_from_sensor);
    if (!hand_eye) return hand_eye.error();
    out.setup.camera = *camera;
    out.setup.camera_from_sensor = *hand_eye;
    return {};
  }
  if (!record) {
    return Error{Errc::not_found, fmt::format("{}: no calibration was in force; give --calibration, or --camera and "
                                              "--camera-from-sensor",
                                              inputs.recording.string())};
  }
  if (!record->lens || !record->hand_eye) {
    return Error{Errc::bad_value,
                 fmt::format("{}: the record has no {}; calibrate it, or give --camera and "
                             "--camera-from-sensor",
                             (inputs.calibration.empty() ? inputs.recording : inputs.calibration).string(),
                             record->lens ? "hand-eye" : "lens")};
  }
  out.setup.camera = record->lens->camera;
  out.setup.camera_from_sensor = record->hand_eye->camera_from_sensor;
  out.calibration.camera_rms_px = record->lens->rms_px;
  out.calibration.tracked_rms_px = record->hand_eye->held_out_px;
  return {};
}

Result<Eigen::Vector3d> tip_of(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record) {
  if (inputs.tip.empty()) {
    if (record && record->tip) return record->tip->tip_in_sensor_mm;
    return Error{Errc::bad_value, "--fiducials: the pointer's tip is not known; give --tip, or a record that has it"};
  }
  const auto points = read_points(inputs.tip);
  if (!points) return points.error();
  if (points->size() == 1) return points->front();
  return Error{Errc::bad_format,
               fmt::format("{}: {} points where the tip is one", inputs.tip.string(), points->size())};
}

Result<void> register_by_touches(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record,
                                 ReplaySetup& out) {
  const auto markers = read_points(inputs.fiducials);
  if (!markers) return markers.error();
  const auto tip = tip_of(inputs, record);
  if (!tip) return tip.error();
  TouchDetector detector;
  std::optional<DeviceTime> first;
  const auto looked = look_through(inputs, [&](const wire::Event& event) {
    const auto* birds = std::get_if<wire::Birds>(&event);
    if (birds == nullptr) return;
    if (!first) first = birds->acquired;
    const double at_s = (birds->acquired - *first).seconds();
    if (!inputs.touched_s.empty() && (at_s < inputs.touched_s[0] || at_s > inputs.touched_s[1])) return;
    for (const wire::Bird& bird : birds->birds) {
      if (bird.name != inputs.pointer) continue;
      if (const auto touch = detector.push(birds->acquired, bird.tracker_from_sensor * *tip))
        out.touches_in_tracker_mm.push_back(touch->tip_in_tracker_mm);
    }
  });
  if (!looked) return looked.error();
  const auto fit = match_and_fit(*markers, out.touches_in_tracker_mm);
  if (!fit) {
    return Error{fit.error().code, fmt::format("{}: {} rests of \"{}\", {}: {}; --touched says when to look",
                                               inputs.recording.string(), out.touches_in_tracker_mm.size(),
                                               inputs.pointer, inputs.fiducials.string(), fit.error().what)};
  }
  out.setup.tracker_from_patient = fit->fit.to_from.inverse();
  out.calibration.fre_mm = fit->fit.fre_rms_mm;
  return {};
}

Result<void> take_registration(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record,
                               ReplaySetup& out) {
  const int ways = (inputs.patient_from_tracker.empty() ? 0 : 1) + (inputs.tracker_from_patient.empty() ? 0 : 1) +
                   (inputs.fiducials.empty() ? 0 : 1);
  if (ways != 1) {
    return Error{Errc::bad_value,
                 "give one registration: --registration, --tracker-from-patient, or --fiducials that were touched"};
  }
  if (!inputs.fiducials.empty()) {
    if (auto done = register_by_touches(inputs, record, out); !done) return done;
  } else if (!inputs.patient_from_tracker.empty()) {
    const auto read = read_transform<Patient, Tracker>(inputs.patient_from_tracker);
    if (!read) return read.error();
    out.setup.tracker_from_patient = read->inverse();
  } else {
    const auto read = read_transform<Tracker, Patient>(inputs.tracker_from_patient);
    if (!read) return read.error();
    out.setup.tracker_from_patient = *read;
  }
  if (inputs.patient_from_model.empty()) return {};
  const auto model = read_transform<Patient, Patient>(inputs.patient_from_model);
  if (!model) return model.error();
  out.setup.tracker_from_patient = out.setup.tracker_from_patient * *model;
  return {};
}

}  // namespace

Result<ReplaySetup> read_replay_setup(const ReplayInputs& inputs) {
  ReplaySetup out;
  const auto record = record_of(inputs);
  if (!record) return record.error();
  if (auto taken = take_calibration(inputs, *record, out); !taken) return taken.error();
  if (auto taken = take_registration(inputs, *record, out); !taken) return taken.error();
  const auto figure = [&](const char* name, const std::optional<double>& told, bool found, double& value) {
    if (told) value = *told;
    if (!told && !found) out.unknown.emplace_back(name);
  };
  const bool from_record = inputs.camera.empty();
  figure("camera_rms_px", inputs.camera_rms_px, from_record, out.calibration.camera_rms_px);
  figure("tracked_rms_px", inputs.tracked_rms_px, from_record, out.calibration.tracked_rms_px);
  figure("fre_mm", inputs.fre_mm, !inputs.fiducials.empty(), out.calibration.fre_mm);
  return out;
}

}  // namespace birdseye::host
