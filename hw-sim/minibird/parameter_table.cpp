#include "hw-sim/minibird/parameter_table.hpp"

#include <initializer_list>
#include <string_view>

namespace birdseye::hw_sim {

namespace {

constexpr unsigned revision(unsigned integer, unsigned fraction) {
  return 256 * integer + fraction;
}

constexpr ParameterRule kRules[] = {
    {kStatus, 0, 2, 0},
    {kRevision, 0, 2, 0},
    {kCrystal, 0, 2, 0},
    {kScale, 2, 2, 0},
    {kFilters, 2, 2, 0},
    {kAlphaMin, 14, 14, 0},
    {kRateCount, 2, 2, 0},
    {kRate, 2, 2, revision(3, 64)},
    {kDataReady, 1, 1, 0},
    {kDataReadyCharacter, 1, 1, 0},
    {kError, 0, 1, 0},
    {kErrorHandling, 1, 1, 0},
    {kVmTable, 14, 14, 0},
    {kAlphaMax, 14, 14, 0},
    {kSuddenChange, 1, 1, 0},
    {kModel, 0, 10, 0},
    {kExpandedError, 0, 2, 0},
    {kReferenceForPosition, 1, 1, revision(3, 45)},
    {kTransmitterMode, 1, 1, revision(3, 66)},
    {kAddressing, 1, 1, revision(3, 67)},
    {kLineFrequency, 1, 1, revision(3, 67)},
    {kAddress, 1, 1, revision(3, 67)},
    {kHemisphere, 2, 2, revision(3, 67)},
    {kAngleAlign, 6, 6, revision(3, 67)},
    {kReferenceFrame, 6, 6, revision(3, 67)},
    {kUnitSerial, 0, 2, revision(3, 67)},
    {kSensorSerial, 0, 2, revision(3, 71)},
    {kTransmitterSerial, 0, 2, revision(3, 71)},
    {kHostDelay, 2, 2, 0},
    {kConfiguration, 5, 5, 0},
    {kArm, 1, 14, 0},
    {kGroupMode, 1, 1, revision(3, 33)},
    {kSystemStatus, 0, 14, 0},
    {kAutoConfiguration, 1, 5, 0},
};

std::vector<std::uint8_t> words(std::initializer_list<unsigned> values) {
  std::vector<std::uint8_t> bytes;
  for (const unsigned value : values) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  }
  return bytes;
}

}  // namespace

const ParameterRule* parameter_rule(std::uint8_t number, unsigned of_revision) {
  for (const ParameterRule& rule : kRules) {
    if (rule.number == number) return of_revision >= rule.since_revision ? &rule : nullptr;
  }
  return nullptr;
}

std::size_t examine_bytes(const ParameterRule& rule, Addressing addressing) {
  if (addressing == Addressing::normal) return rule.examine_bytes;
  const bool super = addressing == Addressing::super_expanded;
  switch (rule.number) {
    case kConfiguration:
      return 7;
    case kArm:
      return 30;
    case kSystemStatus:
      return super ? 126 : 30;
    case kAutoConfiguration:
      return super ? 19 : 7;
    default:
      return rule.examine_bytes;
  }
}

std::vector<std::uint8_t> default_value(const ParameterRule& rule) {
  switch (rule.number) {
    case kFilters:
      return words({4});
    case kAlphaMin:
      return words({0x28F, 0x28F, 0x28F, 0x28F, 0x28F, 0x28F, 0x28F});
    case kAlphaMax:
      return words({0x7333, 0x7333, 0x7333, 0x7333, 0x7333, 0x7333, 0x7333});
    case kVmTable:
      return words({2, 6, 26, 99, 396, 1615, 6460});
    case kDataReadyCharacter:
      return {','};
    case kLineFrequency:
      return {60};
    case kHostDelay:
      return words({20});
    case kUnitSerial:
      return words({1001});
    case kSensorSerial:
      return words({2001});
    case kTransmitterSerial:
      return words({3001});
    default:
      return std::vector<std::uint8_t>(rule.examine_bytes, 0);
  }
}

std::size_t command_bytes(std::uint8_t byte) {
  struct Lengths {
    std::string_view bytes;
    std::size_t length;
  };
  static constexpr Lengths kTable[] = {
      {"VWXYZ\\]B@?FGQRSTN/\x11\x13", 1}, {"123456789:;<=>", 1}, {"MA0OP", 2}, {"L", 3}, {"qr", 7}, {"JH", 13},
  };
  for (const Lengths& row : kTable) {
    if (row.bytes.find(static_cast<char>(byte)) != std::string_view::npos) return row.length;
  }
  return 0;
}

}  // namespace birdseye::hw_sim
