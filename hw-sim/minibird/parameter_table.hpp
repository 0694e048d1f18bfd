#pragma once

#include <cstdint>
#include <vector>

namespace birdseye::hw_sim {

/// How units of a flock are numbered: 1..14, 1..30 or 1..126, as parameter 19 has it.
enum class Addressing : std::uint8_t { normal = 0, expanded = 1, super_expanded = 3 };

/// The parameters of EXAMINE and CHANGE by the names that the code uses.
enum ParameterNumber : std::uint8_t {
  kStatus = 0,
  kRevision = 1,
  kCrystal = 2,
  kScale = 3,
  kFilters = 4,
  kAlphaMin = 5,
  kRateCount = 6,
  kRate = 7,
  kDataReady = 8,
  kDataReadyCharacter = 9,
  kError = 10,
  kErrorHandling = 11,
  kVmTable = 12,
  kAlphaMax = 13,
  kSuddenChange = 14,
  kModel = 15,
  kExpandedError = 16,
  kReferenceForPosition = 17,
  kTransmitterMode = 18,
  kAddressing = 19,
  kLineFrequency = 20,
  kAddress = 21,
  kHemisphere = 22,
  kAngleAlign = 23,
  kReferenceFrame = 24,
  kUnitSerial = 25,
  kSensorSerial = 26,
  kTransmitterSerial = 27,
  kHostDelay = 32,
  kConfiguration = 33,
  kArm = 34,
  kGroupMode = 35,
  kSystemStatus = 36,
  kAutoConfiguration = 50,
};

/// What a parameter is on the wire. revision: 256 * integer part + fraction of the firmware.
struct ParameterRule {
  std::uint8_t number;
  std::uint8_t change_bytes;   ///< after the parameter's number; 0: cannot be changed
  std::uint8_t examine_bytes;  ///< in normal addressing
  unsigned since_revision;     ///< the first firmware that knows it
};

/// The rule of a parameter; null for a number that firmware of this revision does not know.
const ParameterRule* parameter_rule(std::uint8_t number, unsigned revision);
/// The length of the reply to EXAMINE; some replies are longer where there may be more units.
std::size_t examine_bytes(const ParameterRule& rule, Addressing addressing);
/// The value after power-up of a parameter that is merely stored.
std::vector<std::uint8_t> default_value(const ParameterRule& rule);

/// Whole length of a command by its first byte; 0 for a byte that is no command. EXAMINE and CHANGE without the value.
std::size_t command_bytes(std::uint8_t byte);

}  // namespace birdseye::hw_sim
