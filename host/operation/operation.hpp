#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/overlay/frame_overlay.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What was found during an operation, kept in a folder so that a window that was closed can be opened again where it
/// was. The files are those of the other commands: replay, export and render take them.
struct Operation {
  /// By the board, in the window; empty where the appliance has a record.
  struct Calibrated {
    CameraModel camera;
    Transform<Camera, Sensor> camera_from_sensor;
    double camera_rms_px = 0, tracked_rms_px = 0, hand_eye_mm = 0;
    std::string made_utc;
  };
  /// By touched fiducials.
  struct Registered {
    Transform<Patient, Tracker> patient_from_tracker;
    double fre_mm = 0;
    std::vector<Eigen::Vector3d> fiducials_in_patient_mm;  ///< those that were touched
  };
  /// By views.
  struct Deformed {
    DisplacementField field;  ///< patient LPS, mm
    std::optional<double> uncertainty_mm;
  };
  std::string ct_checksum;  ///< which CT it was of: another's registration is refused
  std::string made_utc;     ///< 2026-11-22T09:30:00Z
  std::optional<Calibrated> calibrated;
  std::optional<Registered> registered;
  std::optional<Deformed> deformation;
};

/// Of the voxels and where they lie.
std::string ct_checksum(const Volume& ct);

/// The time of day: 2026-11-22T09:30:00Z.
std::string utc_now();

/// operation.json, and beside it camera.yaml, camera_from_sensor.txt, patient_from_tracker.txt and field.mha, as far as
/// there are such.
Result<void> write_operation(const std::filesystem::path& folder, const Operation& operation);
bool has_operation(const std::filesystem::path& folder);
/// Refuses, naming the file, what is missing or damaged.
Result<Operation> read_operation(const std::filesystem::path& folder);

}  // namespace birdseye::host
