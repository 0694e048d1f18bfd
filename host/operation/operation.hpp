#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/files/authors.hpp"
#include "host/files/sealed_text.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// What was found during an operation, kept in a folder so that a window that was closed can be opened again where it
/// was, and so that other commands use what the window found.
struct Operation {
  std::string ct_sha256;                          ///< which CT it was of: another's registration is refused
  StatedGeometry ct_stated;                       ///< of where its voxels lie, by a person
  std::string labels_sha256;                      ///< and which labels; empty: there were none
  std::string made_utc;                           ///< 2026-11-22T09:30:00Z
  std::string record_sha256;                      ///< of the calibration record in force; empty: there was none
  std::optional<CalibratedScope> calibrated;      ///< by the board or by the record
  std::optional<RegisteredPatient> registered;    ///< by touched fiducials
  std::shared_ptr<const DeformedOrgan> deformed;  ///< by views; null: it is not
  /// What of it rests on files that no known machine signed, or that it is itself such a file, in words; empty:
  /// nothing.
  std::string doubt = {};
  /// That a person picked in the CT, and that may tell whether a registration holds; in the CT as it was taken.
  std::vector<NamedPoint> landmarks = {};
};

/// operation.json holds all of it, sealed and signed by this machine: not one bit of it may change. It is written
/// first, and whole. Beside it, for other programs, stand copies of what is in it: camera.yaml, camera_from_sensor.txt,
/// patient_from_tracker.txt and field.mha, as far as there are such; nothing here reads them. Where a file by such a
/// name is there that the operation in the folder did not write, nothing is written, and the error names the file.
Result<void> write_operation(const std::filesystem::path& folder, const Operation& operation,
                             const ThisMachine& machine);
bool has_operation(const std::filesystem::path& folder);
/// path: the file, or the folder that holds it. Refuses, naming the file and its part, what is missing, damaged or
/// changed, and what 0.1.0 wrote, whose files nothing binds together; and what authors do not admit.
Result<Operation> read_operation(const std::filesystem::path& path, const Authors& authors);
/// For conversions, whoever wrote it: what is not signed by a known machine has a line on stderr.
Result<Operation> read_operation(const std::filesystem::path& path);

inline constexpr const char* kOperationFormat = "birdseye operation";
/// An operation, and who says that they wrote it.
struct SignedOperation {
  Operation operation;
  SealedBy by;
};
Result<SignedOperation> read_signed_operation(const std::filesystem::path& path);

/// Refuses, with the remedy, a CT or labels other than the operation's; the same voxels elsewhere are another CT.
/// ct_sha256: host/overlay/ct_sha256.hpp; labels_sha256: host/files/files_sha256.hpp, or empty where no labels are
/// given.
Result<void> check_patient(const Operation& operation, const std::string& ct_sha256, const std::string& labels_sha256);

/// Refuses a deformation whose expected error is of another target than this one, in the CT as it was taken. What does
/// not say which target that was passes.
Result<void> check_target(const Operation& operation, const Eigen::Vector3d& target_at_rest_mm);

}  // namespace birdseye::host
