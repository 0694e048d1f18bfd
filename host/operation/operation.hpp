#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "host/operation/findings.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What was found during an operation, kept in a folder so that a window that was closed can be opened again where it
/// was. The files are those of the other commands: replay, export and render take them.
struct Operation {
  std::string ct_checksum;                        ///< which CT it was of: another's registration is refused
  std::string made_utc;                           ///< 2026-11-22T09:30:00Z
  std::optional<CalibratedScope> calibrated;      ///< by the board; empty where the appliance has a record
  std::optional<RegisteredPatient> registered;    ///< by touched fiducials
  std::shared_ptr<const DeformedOrgan> deformed;  ///< by views; null: it is not
};

/// Of the voxels and where they lie.
std::string ct_checksum(const Volume& ct);

/// operation.json, and beside it camera.yaml, camera_from_sensor.txt, patient_from_tracker.txt and field.mha, as far as
/// there are such.
Result<void> write_operation(const std::filesystem::path& folder, const Operation& operation);
bool has_operation(const std::filesystem::path& folder);
/// Refuses, naming the file, what is missing or damaged.
Result<Operation> read_operation(const std::filesystem::path& folder);

}  // namespace birdseye::host
