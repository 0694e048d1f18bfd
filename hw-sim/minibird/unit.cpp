#include "hw-sim/minibird/unit.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "calibration/base/units.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::uint8_t kErrorInvalidCommand = 6;

enum Parameter : std::uint8_t {
  kStatus = 0,
  kRevision = 1,
  kCrystal = 2,
  kScale = 3,
  kFilters = 4,
  kRateCount = 6,
  kRate = 7,
  kError = 10,
  kModel = 15,
  kExpandedError = 16,
  kLineFrequency = 20,
  kAddress = 21,
  kHemisphere = 22,
  kGroupMode = 35,
  kSystemStatus = 36,
  kAutoConfiguration = 50,
};

struct Lengths {
  std::string_view bytes;
  std::size_t length;
};

/// The length that a table gives a byte; 0 for one that it does not name.
std::size_t length_of(std::uint8_t byte, std::span<const Lengths> table) {
  for (const Lengths& row : table) {
    if (row.bytes.find(static_cast<char>(byte)) != std::string_view::npos) return row.length;
  }
  return 0;
}

/// Bytes of a CHANGE VALUE after the parameter number; 0 for one that cannot be changed.
std::size_t change_bytes(std::uint8_t parameter) {
  static constexpr Lengths kTable[] = {
      {"\x08\x09\x0B\x0E\x11\x12\x13\x14\x15\x23\x32", 1},
      {"\x03\x04\x06\x07\x16\x20", 2},
      {"\x17\x18", 6},
      {"\x05\x0C\x0D", 14},
  };
  return length_of(parameter, kTable);
}

/// Whole length of a command by its first byte; 0 for a byte that is no command. CHANGE grows with its parameter.
std::size_t command_bytes(std::uint8_t byte) {
  static constexpr Lengths kTable[] = {
      {"VWXYZ\\]B@?FGQRSTN/\x11\x13", 1}, {"MA0OP", 2}, {"L", 3}, {"qr", 7}, {"JH", 13},
  };
  return length_of(byte, kTable);
}

}  // namespace

Unit::Unit(const UnitSettings& settings) : settings_(settings) {
  settings_.model.resize(10, ' ');
  reset();
}

void Unit::reset() {
  birds_.assign(static_cast<std::size_t>(std::max(1, settings_.birds)), Bird{});
  rate_hz_ = settings_.rate_hz;
  group_mode_ = configured_ = streaming_ = asleep_ = suspended_ = false;
  points_due_ = 0;
  addressed_ = 0;
  report_every_ = 1;
  parameters_.fill(0);
  parameters_[9] = ',';
  parameters_[kLineFrequency] = 60;
  filters_ = {4, 0};
  command_.clear();
  long_prefix_ = false;
}

std::vector<std::uint8_t> Unit::receive(std::uint8_t byte) {
  std::vector<std::uint8_t> reply;
  if (long_prefix_) {
    addressed_ = std::clamp<std::size_t>(byte, 1, birds_.size()) - 1;
    long_prefix_ = false;
    return reply;
  }
  if (command_.empty()) {
    if (byte == 0xA0) {
      long_prefix_ = true;
      return reply;
    }
    if (byte >= 0xF0) {
      addressed_ = std::clamp<std::size_t>(byte & 0x0FU, 1, birds_.size()) - 1;
      return reply;
    }
    command_length_ = command_bytes(byte);
    if (command_length_ == 0) {
      birds_[addressed_].error = kErrorInvalidCommand;
      addressed_ = 0;
      return reply;
    }
  }
  command_.push_back(byte);
  if (command_.size() == 2 && command_[0] == 'P') command_length_ = 2 + change_bytes(byte);
  if (command_.size() < command_length_) return reply;
  execute(reply);
  command_.clear();
  addressed_ = 0;
  return reply;
}

void Unit::execute(std::vector<std::uint8_t>& reply) {
  Bird& bird = birds_[addressed_];
  const std::uint8_t code = command_[0];
  switch (code) {
    case 'V':
    case 'W':
    case 'X':
    case 'Y':
    case 'Z':
    case '\\':
    case ']':
      bird.format = static_cast<OutputFormat>(code - 0x55);
      break;
    case 'B':
      streaming_ = false;
      points_due_ = 1;
      point_bird_ = addressed_;
      break;
    case '@':
      streaming_ = true;
      break;
    case '?':
      streaming_ = false;
      break;
    case 'F':
      asleep_ = false;
      break;
    case 'G':
      asleep_ = true;
      break;
    case 'Q':
      report_every_ = 1;
      break;
    case 'R':
      report_every_ = 2;
      break;
    case 'S':
      report_every_ = 8;
      break;
    case 'T':
      report_every_ = 32;
      break;
    case 'M':
      bird.button_mode = command_[1] != 0;
      break;
    case 'N':
      reply.push_back(0);
      break;
    case 'L':
      bird.hemisphere = {command_[1], command_[2]};
      break;
    case '/':
      configured_ = group_mode_ = streaming_ = false;
      break;
    case 0x11:
      suspended_ = false;
      break;
    case 0x13:
      suspended_ = true;
      break;
    case 'O':
      examine(command_[1], reply);
      break;
    case 'P':
      change(command_[1], std::span(command_).subspan(2));
      break;
    default:
      break;  // accepted and without effect on this unit: sync, alignment, next transmitter
  }
}

std::uint16_t Unit::status_word() const {
  const Bird& bird = birds_[addressed_];
  unsigned word = addressed_ == 0 ? 0x8000U : 0U;
  if (configured_ || birds_.size() == 1) word |= 0x4000U;
  if (bird.error != 0) word |= 0x2000U;
  if (!asleep_) word |= 0x1000U;
  if (suspended_) word |= 0x0040U;
  if (asleep_) word |= 0x0020U;
  word |= static_cast<unsigned>(bird.format) << 1U;
  if (streaming_) word |= 1U;
  return static_cast<std::uint16_t>(word);
}

void Unit::examine(std::uint8_t parameter, std::vector<std::uint8_t>& reply) {
  Bird& bird = birds_[addressed_];
  const auto put_word = [&](unsigned word) {
    reply.push_back(static_cast<std::uint8_t>(word & 0xFFU));
    reply.push_back(static_cast<std::uint8_t>((word >> 8U) & 0xFFU));
  };
  switch (parameter) {
    case kStatus:
      put_word(status_word());
      break;
    case kRevision:
      reply = {settings_.revision_major, settings_.revision_minor};
      break;
    case kCrystal:
      reply = {settings_.crystal_mhz, 0};
      break;
    case kScale:
      put_word(bird.wide_scale ? 1 : 0);
      break;
    case kFilters:
      reply.assign(filters_.begin(), filters_.end());
      break;
    case kRateCount:
      put_word(static_cast<unsigned>((settings_.crystal_mhz / 8.0) * 1000.0 * ((1000.0 / rate_hz_ - 0.3) / 4.0)));
      break;
    case kRate:
      put_word(static_cast<unsigned>(rate_hz_ * 256.0));
      break;
    case kError:
      reply = {bird.error};
      bird.error = 0;
      break;
    case kExpandedError:
      reply = {bird.error, 0};
      bird.error = 0;
      break;
    case kModel:
      reply.assign(settings_.model.begin(), settings_.model.end());
      break;
    case kAddress:
      reply = {static_cast<std::uint8_t>(birds_.size() == 1 ? 0 : addressed_ + 1)};
      break;
    case kHemisphere:
      reply.assign(bird.hemisphere.begin(), bird.hemisphere.end());
      break;
    case kGroupMode:
      reply = {static_cast<std::uint8_t>(group_mode_ ? 1 : 0)};
      break;
    case kSystemStatus:
      reply.assign(14, 0);
      for (std::size_t i = 0; i < std::min<std::size_t>(birds_.size(), 14); ++i) {
        reply[i] = static_cast<std::uint8_t>(0xA0 | (configured_ && !asleep_ ? 0x40 : 0) | (i == 0 ? 1 : 0));
      }
      break;
    case kAutoConfiguration: {
      if (!configured_) {
        reply.assign(5, 0);
        break;
      }
      const unsigned all = ((1U << birds_.size()) - 1U) << 1U;
      reply = {1};
      put_word(all);
      put_word(all & ~2U);
      break;
    }
    default:
      // The rest that can be set is only stored.
      if (change_bytes(parameter) == 1) {
        reply = {parameters_[parameter]};
      } else {
        bird.error = kErrorInvalidCommand;
      }
  }
}

void Unit::change(std::uint8_t parameter, std::span<const std::uint8_t> value) {
  if (value.empty()) {
    birds_[addressed_].error = kErrorInvalidCommand;
    return;
  }
  const unsigned word = value.size() >= 2 ? value[0] + 256U * value[1] : value[0];
  switch (parameter) {
    case kScale:
      birds_[addressed_].wide_scale = word != 0;
      break;
    case kFilters:
      filters_ = {value[0], value[1]};
      break;
    case kRate:
      rate_hz_ = std::clamp(word / 256.0, 14.0, 144.0);
      break;
    case kRateCount:
      rate_hz_ = std::clamp(1000.0 / (4.0 * word * (8.0 / settings_.crystal_mhz) / 1000.0 + 0.3), 14.0, 144.0);
      break;
    case kHemisphere:
      birds_[addressed_].hemisphere = {value[0], value[1]};
      break;
    case kGroupMode:
      group_mode_ = value[0] != 0;
      break;
    case kAutoConfiguration:
      configured_ = true;
      break;
    default:
      parameters_[parameter] = value[0];
  }
}

std::vector<std::uint8_t> Unit::record(std::size_t index, const BirdPose& pose) const {
  const Bird& bird = birds_[index];
  // A dipole field is even: the unit cannot tell p from -p and answers with the one inside the chosen half-space.
  BirdPose reported = pose;
  const double side = pose.position_mm[bird.hemisphere[0] / 6 % 3];
  if (bird.hemisphere[1] == 0 ? side < 0 : side > 0) reported.position_mm = -pose.position_mm;
  auto bytes = phased_bytes(record_words(bird.format, reported, (bird.wide_scale ? 72.0 : 36.0) * kMmPerInch));
  if (bird.button_mode) bytes.push_back(0);
  if (group_mode_) bytes.push_back(static_cast<std::uint8_t>(index + 1));
  return bytes;
}

std::vector<std::uint8_t> Unit::measure(std::span<const BirdPose> poses) {
  std::vector<std::uint8_t> out;
  const bool report = cycle_++ % report_every_ == 0;
  if (asleep_ || suspended_) return out;
  const bool wanted = (streaming_ && report) || points_due_ > 0;
  if (!wanted) return out;
  if (group_mode_) {
    for (std::size_t i = 0; i < std::min(birds_.size(), poses.size()); ++i) {
      const auto bytes = record(i, poses[i]);
      out.insert(out.end(), bytes.begin(), bytes.end());
    }
  } else {
    const std::size_t bird = points_due_ > 0 ? point_bird_ : 0;
    out = record(bird, poses[bird]);
  }
  points_due_ = 0;
  return out;
}

}  // namespace birdseye::hw_sim
