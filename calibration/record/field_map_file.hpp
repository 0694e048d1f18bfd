#pragma once

#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/geometry/field_map.hpp"
#include "calibration/record/file_signature.hpp"
#include "calibration/record/identity.hpp"

namespace birdseye::calibration {

/// What a map's file says of where it comes from.
struct FieldMapNotes {
  std::string made_utc;   ///< 2026-11-22T09:30:00Z
  std::string software;   ///< birdseye and its version
  std::string made_from;  ///< how many measurements of what, in words
  Grade grade = Grade::pass;
  double held_out_mm = 0;
  Identity tracker = {};  ///< whose field it is; empty: it does not say
};

/// What tells one field from another of what a tracker says it is: unit and transmitter, not the sensors.
Identity field_of_tracker(const Identity& tracker);
/// Why poses of a tracker must not be corrected by a map; empty where they may, or where the map says of no tracker.
std::string field_misfit(const Identity& of_map, const Identity& tracker);

inline constexpr const char* kFieldMapFormat = "birdseye field map";
/// What a map's signature is over: all of its text but white space, the signature itself and the checksum.
std::string signed_sha256(const FieldMap& map, const FieldMapNotes& notes);
/// JSON with a checksum over all of it.
std::string field_map_text(const FieldMap& map, const FieldMapNotes& notes,
                           const std::optional<FileSignature>& signature = std::nullopt);

/// A map, and who says that they made it.
struct FieldMapFile {
  FieldMap map;
  FieldMapNotes notes;
  std::string sha256;                      ///< signed_sha256(), of the text
  std::optional<FileSignature> signature;  ///< empty: it is signed by nobody
  bool of_010 = false;                     ///< as 0.1.0 wrote it, which signed nothing
};

/// Refuses what is no such text, a later version, a checksum that does not fit, and a map that makes no sense.
Result<FieldMapFile> parse_field_map(const std::string& text);

}  // namespace birdseye::calibration
