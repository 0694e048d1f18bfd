#include <algorithm>

#include "hw-sim/minibird/unit.hpp"
#include "hw-sim/minibird/unit_errors.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kMostErrors = 8;
constexpr double kLowestRateHz = 14, kHighestRateHz = 144;

void put_word(std::vector<std::uint8_t>& bytes, unsigned word) {
  bytes.push_back(static_cast<std::uint8_t>(word & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>((word >> 8U) & 0xFFU));
}

}  // namespace

void Unit::latch(FlockBird& bird, std::uint8_t code, std::uint8_t detail) {
  if (bird.errors.size() < kMostErrors) bird.errors.push_back({code, detail});
}

Addressing Unit::addressing() const {
  const auto found = birds_.front().values.find(kAddressing);
  return found == birds_.front().values.end() ? Addressing::normal : static_cast<Addressing>(found->second[0]);
}

std::size_t Unit::most_units() const {
  return addressing() == Addressing::normal ? 14 : addressing() == Addressing::expanded ? 30 : 126;
}

std::uint16_t Unit::status_word() const {
  const FlockBird& bird = birds_[addressed_];
  unsigned word = addressed_ == master_ ? 0x8000U : 0U;
  if (addressed_ < configured_ || birds_.size() == 1) word |= 0x4000U;
  if (!bird.errors.empty()) word |= 0x2000U;
  if (!asleep_) word |= 0x1000U;
  if (addressing() != Addressing::normal) word |= 0x0400U;
  if (sync_mode_ != 0) word |= 0x0200U;
  if (suspended_) word |= 0x0040U;
  if (asleep_) word |= 0x0020U;
  word |= static_cast<unsigned>(bird.format) << 1U;
  if (streaming_) word |= 1U;
  return static_cast<std::uint16_t>(word);
}

std::vector<std::uint8_t> Unit::system_status(std::size_t length) const {
  Bytes bytes(length, 0);
  for (std::size_t i = 0; i < std::min(birds_.size(), length); ++i) {
    const bool runs = i < configured_ && !asleep_;
    bytes[i] = static_cast<std::uint8_t>(0xA0 | (runs ? 0x40 : 0) | (i == 0 ? 1 : 0));
  }
  return bytes;
}

/// Mode, the mask of running units and that of dependents; bit i is address i. Expanded modes go on with the addresses
/// from 15 in words of 15; how the longest form is laid out is not known.
std::vector<std::uint8_t> Unit::auto_configuration(std::size_t length) const {
  Bytes bytes;
  bytes.push_back(configured_ > 0 && birds_.size() > 1 ? 1 : 0);
  unsigned low = 0, high = 0;
  for (std::size_t i = 0; bytes[0] != 0 && i < configured_; ++i) {
    if (i < 14) low |= 1U << (i + 1);
    if (i >= 14 && i < 30) high |= 1U << (i - 14);
  }
  put_word(bytes, low);
  put_word(bytes, low & ~2U);
  put_word(bytes, high);
  bytes.resize(length, 0);
  return bytes;
}

std::vector<std::uint8_t> Unit::take_error(std::size_t length) {
  Bytes bytes(length, 0);
  auto& errors = birds_[addressed_].errors;
  if (errors.empty()) return bytes;
  bytes[0] = errors.front().code;
  if (length > 1) bytes[1] = errors.front().detail;
  errors.pop_front();
  return bytes;
}

void Unit::examine(std::uint8_t parameter, Bytes& reply) {
  FlockBird& bird = birds_[addressed_];
  if (streaming_) ++violations_;
  const ParameterRule* const rule = parameter_rule(parameter, revision());
  if (rule == nullptr) {
    latch(bird, kErrorInvalidCommand);
    return;
  }
  const std::size_t length = examine_bytes(*rule, addressing());
  switch (parameter) {
    case kStatus:
      put_word(reply, status_word());
      break;
    case kRevision:
      reply = {settings_.revision_major, settings_.revision_minor};
      break;
    case kCrystal:
      reply = {settings_.crystal_mhz, 0};
      break;
    case kRateCount:
      put_word(reply,
               static_cast<unsigned>((settings_.crystal_mhz / 8.0) * 1000.0 * ((1000.0 / rate_hz_ - 0.3) / 4.0)));
      break;
    case kRate:
      put_word(reply, static_cast<unsigned>(rate_hz_ * 256.0));
      break;
    case kError:
    case kExpandedError:
      reply = take_error(length);
      break;
    case kModel:
      reply.assign(settings_.model.begin(), settings_.model.end());
      break;
    case kGroupMode:
      reply = {static_cast<std::uint8_t>(group_mode_ ? 1 : 0)};
      break;
    case kSystemStatus:
      reply = system_status(length);
      break;
    case kAutoConfiguration:
      reply = auto_configuration(length);
      break;
    default:
      reply = bird.values[parameter];
      reply.resize(length, 0);
  }
}

void Unit::auto_configure(std::size_t units) {
  if (units > birds_.size()) {
    // The first address that nobody answers at.
    latch(birds_.front(), kErrorNoResponse, static_cast<std::uint8_t>(birds_.size() + 1));
    configured_ = 0;
    return;
  }
  configured_ = units;
}

void Unit::change(std::uint8_t parameter, std::span<const std::uint8_t> value) {
  FlockBird& bird = birds_[addressed_];
  const ParameterRule* const rule = parameter_rule(parameter, revision());
  if (rule == nullptr || rule->change_bytes == 0) {
    latch(bird, kErrorInvalidCommand);
    return;
  }
  const unsigned word = value.size() >= 2 ? value[0] + 256U * value[1] : value[0];
  const bool masters = parameter == kGroupMode || parameter == kAutoConfiguration;
  if (masters && addressed_ != master_) {
    latch(bird, kErrorNotMaster);
    return;
  }
  switch (parameter) {
    case kRate:
      rate_hz_ = std::clamp(word / 256.0, kLowestRateHz, kHighestRateHz);
      break;
    case kRateCount:
      rate_hz_ = std::clamp(1000.0 / (4.0 * word * (8.0 / settings_.crystal_mhz) / 1000.0 + 0.3), kLowestRateHz,
                            kHighestRateHz);
      break;
    case kGroupMode:
      group_mode_ = value[0] != 0;
      break;
    case kAutoConfiguration:
      auto_configure(std::min<std::size_t>(value[0], most_units()));
      break;
    case kAddressing:
      // Every unit of a flock is switched over alike.
      if (value[0] == 0 || value[0] == 1 || value[0] == 3) {
        for (FlockBird& each : birds_) each.values[kAddressing] = {value[0]};
      }
      break;
    default:
      bird.values[parameter].assign(value.begin(), value.end());
  }
}

}  // namespace birdseye::hw_sim
