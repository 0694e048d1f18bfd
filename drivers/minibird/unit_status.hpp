#pragma once

#include <cstdint>
#include <optional>
#include <string>

/// What a miniBIRD says of its own state, as bits and in words: no I/O.
namespace birdseye::drivers::minibird {

/// The status word, bit by bit. Sources disagree on bit 12; `asleep` is what to trust.
struct StatusWord {
  bool master, initialised, error, host_sync, expanded_addressing, crt_sync, no_sync, factory_test, xoff, asleep,
      stream;
  std::uint8_t format_code;
};
StatusWord decode_status_word(std::uint16_t word);
std::string words_of(const StatusWord& status);

/// A unit's error code in words; unknown codes say so.
std::string error_text(std::uint8_t code);
/// Whether the unit stops at such an error until it is reset; its lamp blinks the code meanwhile.
bool is_fatal(std::uint8_t code);

/// One latched error. detail: of the expanded error (parameter 16), where the unit has one.
struct UnitError {
  std::uint8_t code = 0;
  std::optional<std::uint8_t> detail;
};
std::string words_of(const UnitError& error);

/// One byte of the flock's system status (parameter 36).
struct UnitStatus {
  bool accessible, running, has_sensor, extended_range, has_transmitter;
};
UnitStatus decode_unit_status(std::uint8_t byte);

}  // namespace birdseye::drivers::minibird
