#pragma once

#include <string_view>

/// Words by which one program knows again what another says of a calibration record: who says it and who looks for it
/// take them from here.
namespace birdseye::calibration {

/// The remedy for a record that is bound to no instruments.
inline constexpr std::string_view kBindCommand = "birdseye calibrate record FILE --bind";
/// Why a record is not used whose latency holds for another delay than the camera has now.
inline constexpr std::string_view kOfAnotherDelay = "the record's latency was measured with";

}  // namespace birdseye::calibration
