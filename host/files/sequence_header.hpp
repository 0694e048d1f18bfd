#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "calibration/base/result.hpp"

namespace birdseye::host {

// What PLUS calls the fields of a sequence and of its frames. A transform's field is its name, as "StylusToTracker",
// with these at the end.
inline constexpr std::string_view kTransformField = "Transform";
inline constexpr std::string_view kTransformStatusField = "TransformStatus";
inline constexpr std::string_view kTimestampField = "Timestamp";                      ///< s
inline constexpr std::string_view kUnfilteredTimestampField = "UnfilteredTimestamp";  ///< s, as it arrived
inline constexpr std::string_view kImageStatusField = "ImageStatus";
inline constexpr std::string_view kFrameNumberField = "FrameNumber";
inline constexpr std::string_view kStatusOk = "OK", kStatusInvalid = "INVALID";

/// The header of a PLUS sequence: MetaImage (.igs.mha, .igs.mhd) or NRRD.
struct SequenceHeader {
  using Fields = std::map<std::string, std::string, std::less<>>;
  Fields fields;                         ///< of the whole, as DimSize
  std::map<std::size_t, Fields> frames;  ///< by number: what Seq_Frame0007_... says, as "StylusToTrackerTransform"
  std::set<std::string> transforms;      ///< that any frame has, without "Transform" at the end
  bool whole = false;                    ///< the header came to its end, where it says where the pixels are
  std::uint64_t data_offset = 0;         ///< where in the file the header ends
};

/// What is read of a header at most: memory takes some 250 bytes a field beside its text. An hour of 100 frames a
/// second with 20 fields each, matrices among them, has 7.2 million fields and 0.8 GB of text.
struct HeaderBounds {
  std::size_t fields = 8'000'000;
  std::uint64_t bytes = std::uint64_t{1} << 30U;
};

/// Reads the header. Refuses, naming the file, what is not there, cannot be opened or cannot be read to its end, a
/// field that stands twice with different values, and a header beyond the bounds. A file without such fields gives an
/// empty header.
Result<SequenceHeader> read_sequence_header(const std::filesystem::path& path, const HeaderBounds& most = {});

std::string_view value_of(const SequenceHeader::Fields& fields, std::string_view key);

/// As MetaIO takes it: "True", "T", "1" and what begins as these is true, all else is not.
bool says_true(const SequenceHeader::Fields& fields, std::string_view key);

}  // namespace birdseye::host
