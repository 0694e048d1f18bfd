#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/overlay/frame_overlay.hpp"

namespace birdseye::host {

/// Where `birdseye replay` is to take calibration and registration from; what is not named stays empty.
struct ReplayInputs {
  std::filesystem::path recording;
  std::string transform;              ///< of a PLUS sequence
  std::filesystem::path calibration;  ///< a record; without it and a camera, the recording's own
  std::filesystem::path camera, camera_from_sensor;
  std::filesystem::path patient_from_tracker, tracker_from_patient;
  std::filesystem::path fiducials, tip;      ///< markers in the CT; the pointer's tip, where the record has none
  std::string pointer = "pointer";           ///< the bird that touched them
  std::vector<double> touched_s;             ///< from and to, s of the recording: when; empty: any time
  std::filesystem::path patient_from_model;  ///< of `register views`
  std::optional<double> camera_rms_px, tracked_rms_px, fre_mm;  ///< where no file says
};

struct ReplaySetup {
  Setup setup;
  OverlayGate::Calibration calibration;
  std::vector<std::string> unknown;  ///< figures that nothing says: the gate takes them for perfect
  std::vector<Eigen::Vector3d> touches_in_tracker_mm;
};

/// Refuses, naming file or option: what is missing, given twice, or not what it should be. The registration by touches
/// is the demo's: rests of the pointer's tip, matched to the markers.
Result<ReplaySetup> read_replay_setup(const ReplayInputs& inputs);

}  // namespace birdseye::host
