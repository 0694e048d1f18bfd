#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// A registration as a file: a 4x4 matrix that every program reads, and in remarks about it, which others pass over,
/// what was found with it.
struct RegistrationFile {
  Transform<Patient, Tracker> patient_from_tracker;
  std::string ct_sha256{};         ///< of the CT that it holds for; empty: the file does not say
  std::string made_utc{};          ///< empty: the file does not say
  std::optional<double> fre_mm{};  ///< fiducial registration error, rms; none: the file does not say
};

/// The text, with a sum over all of it in its last line.
std::string registration_text(const RegistrationFile& registration);

/// Reads what registration_text wrote, or a plain matrix, which says nothing of itself: whoever gives it answers for
/// it. Refuses, naming the file: what is no rigid transform, and what was changed or cut off since it was written.
Result<RegistrationFile> read_registration(const std::filesystem::path& path);

/// Refuses a registration that says of itself that it is of another CT.
Result<void> check_ct(const RegistrationFile& registration, const std::string& ct_sha256);

}  // namespace birdseye::host
