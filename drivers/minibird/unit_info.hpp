#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/minibird/dialogue.hpp"
#include "drivers/minibird/unit_status.hpp"

namespace birdseye::drivers::minibird {

/// What one unit says of itself.
struct UnitInfo {
  std::string model;  ///< without the spaces that pad it
  int revision_major = 0, revision_minor = 0;
  int crystal_mhz = 0;
  double mm_per_count = kMmPerCount36Inch;
  std::optional<int> unit_serial, sensor_serial, transmitter_serial;  ///< firmware 3.67, 3.71, 3.71
  std::string latched_error;                                          ///< in words; empty for none
  /// Whether the firmware is this version or later, which decides what the unit can be asked: it does not answer
  /// questions that it does not know.
  [[nodiscard]] bool since(int major, int minor) const {
    return 256 * revision_major + revision_minor >= 256 * major + minor;
  }
};

/// Model, revision, crystal and serial numbers. Errc::bad_format: something answers, but not as a miniBIRD does.
Result<UnitInfo> examine_unit(Dialogue& dialogue, std::uint8_t unit);
/// The latched errors in the unit's order. Reading clears them.
Result<std::vector<UnitError>> read_errors(Dialogue& dialogue, std::uint8_t unit);
std::string words_of(const std::vector<UnitError>& errors);  ///< empty for none

}  // namespace birdseye::drivers::minibird
