#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/files/authors.hpp"

namespace birdseye::host {

inline constexpr const char* kSessionRecordingFormat = "birdseye session recording";

/// Enters the sums of the folder's files into the sheet of a recording that has ended, and this machine's signature
/// over the sheet.
Result<void> sign_recording(const std::filesystem::path& folder, nlohmann::json& sheet, const ThisMachine& machine);

/// Who says that they wrote a recording, and what of it is not as its sheet says.
struct RecordingSeal {
  std::string sha256;                                   ///< of the sheet
  std::optional<calibration::FileSignature> signature;  ///< empty: nobody
  bool ended = false;                                   ///< false: it was cut short, so that nobody could sign it
  std::vector<std::string> changed, missing, added;     ///< files, by their names
};
/// Reads all of the recording's files: as long as the disk takes.
Result<RecordingSeal> read_recording_seal(const std::filesystem::path& folder);

/// As Authors::admit(), with the folder's name. Refuses also where a file was changed, is missing or was added.
/// What is no folder, as a sequence of PLUS, nobody signs: it is admitted.
Result<std::string> admit_recording(const std::filesystem::path& path, const Authors& authors);

}  // namespace birdseye::host
