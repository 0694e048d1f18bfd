#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/files/registration_file.hpp"
#include "host/operation/operation.hpp"
#include "host/operation/replay_hardware.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Where `birdseye replay` is to take calibration and registration from; what is not named stays empty.
struct ReplayInputs {
  std::filesystem::path recording;
  std::string events_sha256;          ///< as RecordingReader::Settings has it
  std::string transform;              ///< of a PLUS sequence
  std::filesystem::path operation;    ///< what a window kept, in place of all that follows
  std::filesystem::path calibration;  ///< a record; without it and a camera, the recording's own
  std::filesystem::path camera, camera_from_sensor;
  std::filesystem::path patient_from_tracker, tracker_from_patient;
  std::filesystem::path fiducials, tip;      ///< markers in the CT; the pointer's tip, where the record has none
  std::string pointer = "pointer";           ///< the bird that touched them
  std::string reference;                     ///< the bird that poses are taken relative to; empty: none
  std::vector<double> touched_s;             ///< from and to, s of the recording: when; empty: any time
  std::filesystem::path patient_from_model;  ///< of `register views`
  std::optional<double> rod_angle_deg;       ///< of a record whose scope's rod turns; empty: nothing is drawn by it
  Authors authors = Authors::for_once();     ///< whose records and operations are used
  std::optional<double> camera_rms_px, held_out_px, fre_mm;  ///< in place of what is found
};

/// What a recording is replayed by.
struct ReplaySetup {
  ScopeSetup scope;
  Transform<Tracker, Patient> tracker_from_patient;
  std::optional<RegisteredPatient> by_touches;     ///< where it is registered anew
  Transform<Patient, Patient> patient_from_model;  ///< identity without a pose of `register views`
  std::optional<double> fre_mm;                    ///< of the touches, or as it is stated
  std::size_t touches = 0;
  bool scope_from_files = false;  ///< lens and hand-eye, in place of a calibration record, which states its figures
  std::optional<Operation> operation{};
  std::optional<RegistrationFile> by_file{};  ///< the registration, where a file brings it
  ReplayHardware hardware{};                  ///< a person's own files hold with any: who gives them answers for them
  std::vector<std::string> cautions{};        ///< in words, each a reason not to call the replay a pass

  [[nodiscard]] Setup setup() const { return scope.registered(tracker_from_patient * patient_from_model); }
};

/// Refuses, naming file or option: what is missing, given twice, or not what it should be. The registration by touches
/// is the operation's: rests of the pointer's tip, matched to the markers.
Result<ReplaySetup> read_replay_setup(const ReplayInputs& inputs);

/// By what the gate judges the replay, and which figures nothing says: files hold none, and whoever gives them answers
/// for them. Nobody answers for what a calibration record does not state.
struct ReplayTrust {
  TrustFigures figures;
  std::vector<std::string> vouched_for;
};
/// The target is the middle of the CT, as in an operation without landmarks.
ReplayTrust trust_of(const ReplaySetup& setup, const Volume& ct);

}  // namespace birdseye::host
