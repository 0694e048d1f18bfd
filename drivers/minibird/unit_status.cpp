#include "drivers/minibird/unit_status.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

namespace birdseye::drivers::minibird {

StatusWord decode_status_word(std::uint16_t word) {
  const auto bit = [word](unsigned n) { return (word >> n & 1U) != 0; };
  StatusWord s{};
  s.master = bit(15);
  s.initialised = bit(14);
  s.error = bit(13);
  s.host_sync = bit(11);
  s.expanded_addressing = bit(10);
  s.crt_sync = bit(9);
  s.no_sync = bit(8);
  s.factory_test = bit(7);
  s.xoff = bit(6);
  s.asleep = bit(5);
  s.stream = bit(0);
  s.format_code = static_cast<std::uint8_t>(word >> 1U & 0xFU);
  return s;
}

std::string error_text(std::uint8_t code) {
  static constexpr std::array<std::string_view, 36> kTexts = {
      "no error",
      "RAM test failed",
      "non-volatile memory write failed",
      "board configuration data corrupt",
      "transmitter data corrupt or transmitter not connected",
      "sensor data corrupt or sensor not connected",
      "invalid RS-232 command",
      "not a bus master",
      "no units accessible on the bus",
      "unit not initialised",
      "bus receive error between birds",
      "RS-232 overrun or framing error",
      "bus receive error from the host",
      "no response from a unit on the bus",
      "invalid host command on the bus",
      "bus run-time error",
      "invalid CPU speed",
      "no data from a unit on the bus",
      "illegal baud rate",
      "unit acknowledge error",
      "CPU overflow",
      "CPU array bounds",
      "CPU unused opcode",
      "CPU escape opcode",
      "CPU reserved interrupt 9",
      "CPU reserved interrupt 10",
      "CPU reserved interrupt 11",
      "numeric processor error",
      "CRT synchronisation error",
      "transmitter not active or not accessible",
      "extended-range transmitter not attached",
      "CPU time overflow",
      "sensor saturated: too close to the transmitter or in a strong field",
      "unit configuration error",
      "watchdog error",
      "over-temperature",
  };
  return code < kTexts.size() ? std::string(kTexts[code]) : fmt::format("unknown error {}", code);
}

UnitStatus decode_unit_status(std::uint8_t byte) {
  const auto bit = [byte](unsigned n) { return (byte >> n & 1U) != 0; };
  return {bit(7), bit(6), bit(5), bit(4), bit(4) ? (byte & 0x0FU) != 0 : bit(0)};
}

std::string words_of(const StatusWord& status) {
  std::string words = status.master ? "master" : "slave";
  const auto add = [&words](bool when, std::string_view text) {
    if (when) words += fmt::format(", {}", text);
  };
  add(!status.initialised, "not initialised");
  add(true, status.asleep ? "asleep" : "awake");
  add(status.stream, "streaming");
  add(status.error, "an error latched");
  add(status.xoff, "output suspended (XOFF)");
  add(status.host_sync || status.crt_sync, "synchronised to something else");
  add(status.expanded_addressing, "expanded addressing");
  add(status.factory_test, "factory test commands enabled");
  return words;
}

std::string words_of(const UnitError& error) {
  // Normal addressing: the low four bits name the unit that does not respond.
  if (error.code == 13 && error.detail) return fmt::format("{} (unit {})", error_text(13), *error.detail & 0x0FU);
  return error_text(error.code);
}

bool is_fatal(std::uint8_t code) {
  return code == 1 || code == 2 || code == 15 || code == 16 || (code >= 20 && code <= 27);
}

}  // namespace birdseye::drivers::minibird
