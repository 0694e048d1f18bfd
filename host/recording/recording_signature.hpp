#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/files/authors.hpp"

namespace birdseye::host {

inline constexpr const char* kSessionRecordingFormat = "birdseye session recording";

/// Enters the sums of what was written into each file of a recording that has ended, by name, into its sheet, and this
/// machine's signature over the sheet.
void sign_recording(nlohmann::json& sheet, const std::map<std::string, std::string>& sums, const ThisMachine& machine);

/// Who says that they wrote a recording, and what of it is not as its sheet says.
struct RecordingSeal {
  std::string sha256;                                   ///< of the sheet
  std::optional<calibration::FileSignature> signature;  ///< empty: nobody
  bool ended = false;                                   ///< false: it was cut short, so that nobody could sign it
  std::vector<std::string> changed, missing, added;     ///< files, by their names
  std::string events_sha256;                            ///< of the events as they were signed; empty: nobody signed
  std::string rests_on;  ///< what its poses rest on that no known machine had signed; empty: on nothing such
};
/// Reads all of the recording's files: as long as the disk takes.
Result<RecordingSeal> read_recording_seal(const std::filesystem::path& folder);

/// The recording that a path is, or that the file at it belongs to, whichever links lead there: its poses are the
/// recording's. Empty: there is none.
std::optional<std::filesystem::path> recording_at(const std::filesystem::path& path);

struct AdmittedRecording {
  std::string doubt;          ///< that its author, or that of what its poses rest on, is not known; empty: all are
  std::string events_sha256;  ///< that its reader compares the events with; empty: nobody signed
};

/// As Authors::admit(), with the recording's name: of a session recording, and of an appliance recording. Refuses also
/// where a file was changed, is missing or was added, and bytes behind a signature. Anything else, as a sequence of
/// PLUS, nobody signs: it is admitted. A file of a session recording is admitted as that is.
Result<AdmittedRecording> admit_recording(const std::filesystem::path& path, const Authors& authors);

}  // namespace birdseye::host
