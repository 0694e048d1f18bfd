#include "host/operation/replay_setup.hpp"

#include <fmt/format.h>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/record/calibration_record.hpp"
#include "calibration/record/sha256.hpp"
#include "drivers/system/clock.hpp"
#include "host/files/named_points.hpp"
#include "host/files/record_file.hpp"
#include "host/files/text_files.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/pointer_tip.hpp"
#include "host/operation/reference_sensor.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

using calibration::CalibrationRecord;
/// Calls take with every event but the pixels.
template <typename Take>
Result<void> look_through(const ReplayInputs& inputs, const Take& take) {
  const auto reader = RecordingReader::open(
      inputs.recording,
      {.speed = 0, .transform = inputs.transform, .pictures = false, .events_sha256 = inputs.events_sha256});
  if (!reader) return reader.error();
  for (;;) {
    const auto event = (*reader)->next(host_now());
    if (!event && event.error().code == Errc::disconnected) return {};
    if (!event) return event.error();
    if (*event) take(**event);
  }
}

/// What the recording itself says.
struct Told {
  Instruments first;   ///< the first identities that it tells
  std::string record;  ///< the last record that was in force; empty: none was
};

Result<Told> told_by(const ReplayInputs& inputs) {
  Told told;
  const auto looked = look_through(inputs, [&told](const wire::Event& event) {
    if (const auto* health = std::get_if<wire::Health>(&event)) {
      Instruments now;
      take_identities(*health, now);
      if (told.first.tracker.empty()) told.first.tracker = now.tracker;
      if (told.first.camera.empty()) told.first.camera = now.camera;
    }
    const auto* calibration = std::get_if<wire::Calibration>(&event);
    if (calibration != nullptr && calibration->in_force) told.record = calibration->record;
  });
  if (!looked) return looked.error();
  return told;
}

/// The one that is named, or that was in force when it was recorded, if one was.
Result<std::optional<AdmittedRecord>> record_of(const ReplayInputs& inputs, const Told& told) {
  const bool used = inputs.camera.empty() || !inputs.fiducials.empty();
  if (inputs.calibration.empty() && (told.record.empty() || !used)) return std::optional<AdmittedRecord>();
  auto read = inputs.calibration.empty()
                  ? admit_record(told.record, inputs.authors).with_context(inputs.recording.string())
                  : read_record(inputs.calibration, inputs.authors);
  if (!read) return read.error();
  return std::optional(*std::move(read));
}

template <typename To, typename From>
Result<Transform<To, From>> read_transform(const std::filesystem::path& path) {
  const auto matrix = read_pose(path);
  if (!matrix) return matrix.error();
  return Transform<To, From>::from_matrix(*matrix);
}

/// What a person states in place of what was found has to be an error that can be.
Result<void> check_stated(const ReplayInputs& inputs) {
  const auto check = [](const char* option, const std::optional<double>& figure, bool may_be_0) -> Result<void> {
    if (!figure || (is_measured_error(*figure) && (may_be_0 || *figure > 0))) return {};
    return Error{Errc::bad_value,
                 fmt::format("{} {:g}: no measurement is off so much; give a number {}, or leave it out", option,
                             *figure, may_be_0 ? "from 0 on" : "above 0")};
  };
  if (auto sound = check("--camera-rms-px", inputs.camera_rms_px, false); !sound) return sound;
  if (auto sound = check("--hand-eye-rms-px", inputs.held_out_px, false); !sound) return sound;
  return check("--fre-mm", inputs.fre_mm, true);
}

Result<ScopeSetup> scope_of(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record) {
  if (inputs.camera.empty() != inputs.camera_from_sensor.empty())
    return Error{Errc::bad_value, "--camera and --camera-from-sensor go together; give both, or --calibration"};
  const ScopeFigures stated{inputs.camera_rms_px, inputs.held_out_px, std::nullopt};
  if (!inputs.camera.empty()) return ScopeSetup::of_files(inputs.camera, inputs.camera_from_sensor, stated);
  if (!record) {
    return Error{Errc::not_found, fmt::format("{}: no calibration was in force; give --calibration, or --camera and "
                                              "--camera-from-sensor",
                                              inputs.recording.string())};
  }
  auto scope = ScopeSetup::of_record(*record, stated);
  if (scope) return inputs.rod_angle_deg ? scope->turned_to(*inputs.rod_angle_deg) : *std::move(scope);
  return Error{Errc::bad_value,
               fmt::format("{}: the record has no {}; calibrate it, or give --camera and "
                           "--camera-from-sensor",
                           (inputs.calibration.empty() ? inputs.recording : inputs.calibration).string(),
                           record->lens ? "hand-eye" : "lens")};
}

Result<Eigen::Vector3d> tip_of(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record) {
  if (inputs.tip.empty()) {
    if (record && record->tip) return record->tip->tip_in_sensor_mm;
    return Error{Errc::bad_value, "--fiducials: the pointer's tip is not known; give --tip, or a record that has it"};
  }
  const auto points = read_points(inputs.tip, PointsOf::sensor);
  if (!points) return points.error();
  if (points->size() == 1) return points->front();
  return Error{Errc::bad_format,
               fmt::format("{}: {} points where the tip is one", inputs.tip.string(), points->size())};
}

Result<void> register_anew(const ReplayInputs& inputs, const std::optional<CalibrationRecord>& record,
                           ReplaySetup& out) {
  const auto markers = read_points(inputs.fiducials, PointsOf::patient);
  if (!markers) return markers.error();
  const auto tip = tip_of(inputs, record);
  if (!tip) return tip.error();
  PointerTip pointer;
  ReferenceSensor reference;
  reference.use(inputs.reference, "");
  std::optional<DeviceTime> first;
  std::vector<Eigen::Vector3d> touched_in_tracker_mm;
  const auto looked = look_through(inputs, [&](const wire::Event& event) {
    if (!std::holds_alternative<wire::Birds>(event)) return;
    const ReferenceSensor::Relative relative = reference.take(event);
    // Touches from before and after it moved are of two patients.
    if (relative.news != ReferenceSensor::News::none) touched_in_tracker_mm.clear();
    const auto* birds = std::get_if<wire::Birds>(&relative.event);
    if (!first) first = birds->acquired;
    const double at_s = (birds->acquired - *first).seconds();
    if (!inputs.touched_s.empty() && (at_s < inputs.touched_s[0] || at_s > inputs.touched_s[1])) return;
    if (const auto touch = pointer.take(*birds, inputs.pointer, *tip))
      touched_in_tracker_mm.push_back(touch->tip_in_tracker_mm);
  });
  if (!looked) return looked.error();
  auto fit = register_by_touches(*markers, touched_in_tracker_mm, nullptr);
  out.touches = touched_in_tracker_mm.size();
  if (!fit) {
    return Error{fit.error().code,
                 fmt::format("{}: {} rests of \"{}\", {}: {}; --touched says when to look", inputs.recording.string(),
                             out.touches, inputs.pointer, inputs.fiducials.string(), fit.error().what)};
  }
  out.tracker_from_patient = fit->registered.tracker_from_patient;
  if (!out.fre_mm) out.fre_mm = fit->registered.fre_mm;
  out.by_touches = fit->registered;
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
    if (auto done = register_anew(inputs, record, out); !done) return done;
  } else if (!inputs.patient_from_tracker.empty()) {
    auto read = read_registration(inputs.patient_from_tracker);
    if (!read) return read.error();
    out.tracker_from_patient = read->patient_from_tracker.inverse();
    if (!out.fre_mm) out.fre_mm = read->fre_mm;
    if (read->ct_sha256.empty()) out.cautions.emplace_back(words("why_registration_of_no_ct"));
    out.by_file = *std::move(read);
  } else {
    if (inputs.tracker_from_patient.filename().string().find("patient_from_tracker") != std::string::npos) {
      return Error{Errc::bad_value, fmt::format("{}: by its name it is the inverse of what is asked for; give it as "
                                                "--registration",
                                                inputs.tracker_from_patient.string())};
    }
    const auto read = read_transform<Tracker, Patient>(inputs.tracker_from_patient);
    if (!read) return read.error();
    out.tracker_from_patient = *read;
  }
  if (inputs.patient_from_model.empty()) return {};
  const auto model = read_transform<Patient, Patient>(inputs.patient_from_model);
  if (!model) return model.error();
  out.patient_from_model = *model;
  return {};
}

/// By what a window kept, and by nothing else.
Result<ReplaySetup> setup_of_operation(const ReplayInputs& inputs, const Told& told) {
  auto operation = read_operation(inputs.operation, inputs.authors);
  if (!operation) return operation.error();
  const std::string path = inputs.operation.string();
  if (!operation->calibrated || !operation->registered) {
    return Error{Errc::bad_value, fmt::format("{}: has no {}; give the --out folder of a live that reached its overlay",
                                              path, operation->calibrated ? "registration" : "calibration")};
  }
  const RegisteredPatient& registered = *operation->registered;
  ReplaySetup out{operation->calibrated->scope, registered.tracker_from_patient, registered, {}, registered.fre_mm, 0};
  const std::string remedy = "give the operation that was done with these instruments (--operation)";
  out.hardware = ReplayHardware(
      {{"the operation's calibration", operation->calibrated->found_with, DependsOn::tracker_and_camera, remedy},
       {"the operation's registration", registered.found_with, DependsOn::tracker, remedy}},
      told.first, false);
  if (!told.record.empty() && !operation->calibrated->by_board) {
    const auto record = calibration::parse_record(told.record);
    if (!record || calibration::sha256_of(calibration::record_text(*record)) != operation->record_sha256)
      out.cautions.emplace_back(words("why_other_record"));
  }
  if (!operation->doubt.empty())
    out.cautions.push_back(words("why_unsigned", words("unsigned_operation"), operation->doubt));
  out.operation = *std::move(operation);
  return out;
}

}  // namespace

Result<ReplaySetup> read_replay_setup(const ReplayInputs& inputs) {
  if (auto sound = check_stated(inputs); !sound) return sound.error();
  const auto told = told_by(inputs);
  if (!told) return told.error();
  if (!inputs.operation.empty()) return setup_of_operation(inputs, *told);
  const auto admitted = record_of(inputs, *told);
  if (!admitted) return admitted.error();
  const std::optional<CalibrationRecord> record =
      *admitted ? std::optional((*admitted)->record) : std::optional<CalibrationRecord>();
  auto scope = scope_of(inputs, record);
  if (!scope) return scope.error();
  ReplaySetup out{*std::move(scope), {}, {}, {}, inputs.fre_mm, 0, !inputs.camera.empty()};
  if (auto taken = take_registration(inputs, record, out); !taken) return taken.error();
  if (*admitted && !(*admitted)->doubt.empty())
    out.cautions.push_back(words("why_unsigned", words("unsigned_record"), (*admitted)->doubt));
  if (!out.scope_from_files) {
    out.hardware = ReplayHardware({{"the calibration record",
                                    {record->tracker, record->camera},
                                    DependsOn::tracker_and_camera,
                                    "give the record of these instruments (--calibration)"}},
                                  told->first, inputs.calibration.empty());
  }
  return out;
}

ReplayTrust trust_of(const ReplaySetup& setup, const Volume& ct) {
  const Eigen::Vector3d target_mm = setup.patient_from_model * middle_of_ct(ct);
  TrustFigures known{setup.scope.figures(), setup.fre_mm, std::nullopt};
  if (setup.by_touches) {
    RegisteredPatient registered = *setup.by_touches;
    registered.fre_mm = *setup.fre_mm;
    known = trust_figures(setup.scope.figures(), registered, target_mm);
  }
  known.target_in_patient_mm = middle_of_ct(ct);
  ReplayTrust out{vouched_for(known), {}};
  const auto note = [&out](const char* name, const std::optional<double>& figure) {
    if (!figure) out.vouched_for.emplace_back(name);
  };
  if (setup.scope_from_files) {
    note("camera_rms_px", known.scope.camera_rms_px);
    note("held_out_px", known.scope.held_out_px);
  } else {
    out.figures.scope = known.scope;
  }
  note("fre_mm", known.fre_mm);
  note("target_mm", known.target_mm);
  return out;
}

}  // namespace birdseye::host
