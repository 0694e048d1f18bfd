#pragma once

#include <string>

namespace birdseye::calibration {

inline constexpr const char* kChecksumKey = "checksum";  ///< under which a file has it

/// The checksum of what a JSON file says: SHA-256 over its text without white space, so that the file may be laid out
/// anew but not changed.
std::string checksum_of(const std::string& json_text);
/// Whether the checksum is that of the text. Files of 0.1.0 have CRC-64 of ECMA-182, which is taken too.
bool has_checksum(const std::string& json_text, const std::string& checksum);

}  // namespace birdseye::calibration
