#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/record/file_signature.hpp"

namespace birdseye {

/// Who says that they wrote an appliance recording (docs/manual/appliance-recording.md).
struct ApplianceSeal {
  std::string sha256;                                   ///< of all bytes before the signature
  std::optional<calibration::FileSignature> signature;  ///< empty: nobody, as of one that was cut short
  bool more = false;                                    ///< something stands behind the signature
  std::string rests_on{};  ///< what its poses rest on that no known machine had signed; empty: on nothing such
};

bool is_appliance_recording(const std::filesystem::path& path);
/// Reads all of it. Refuses what is none, or damaged so that its blocks cannot be told.
Result<ApplianceSeal> read_appliance_seal(const std::filesystem::path& path);

}  // namespace birdseye
