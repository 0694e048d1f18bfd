#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace birdseye::calibration {

/// Who wrote a file, as it stands in the file. Whether that is true, drivers/identity tells.
struct FileSignature {
  std::string machine;    ///< what it calls itself
  std::string key;        ///< its public key, 64 hexadecimal digits
  std::string utc;        ///< when it signed: 2026-11-22T09:30:00Z
  std::string signature;  ///< over signed_words(), 128 hexadecimal digits
};

/// What is signed: which kind of file it is, the SHA-256 of everything in it, and who says so when. So a signature
/// holds for no other file, no file of another kind, and nobody else.
std::string signed_words(std::string_view kind, std::string_view sha256, const FileSignature& signature);

/// As which kind birdseyed signs its recordings, which hosts verify.
inline constexpr const char* kApplianceRecordingFormat = "birdseye appliance recording";

inline constexpr const char* kSignedKey = "signed";  ///< under which a file has it
nlohmann::json json_of_signature(const FileSignature& signature);
/// Throws what nlohmann throws where it is none, or more than one.
FileSignature signature_of_json(const nlohmann::json& json);

}  // namespace birdseye::calibration
