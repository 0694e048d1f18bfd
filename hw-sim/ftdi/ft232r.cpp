#include "hw-sim/ftdi/ft232r.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hw-sim/ftdi/descriptors.hpp"

namespace birdseye::hw_sim {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kPayload = Ft232r::kPacket - 2;
constexpr double kMostMismatch = 0.04;  // of two speeds of 8N1 that still understand each other

enum VendorRequest : std::uint8_t {
  kReset = 0x00,
  kModemControl = 0x01,
  kFlowControl = 0x02,
  kBaudRate = 0x03,
  kData = 0x04,
  kModemStatus = 0x05,
  kEventChar = 0x06,
  kErrorChar = 0x07,
  kSetLatency = 0x09,
  kGetLatency = 0x0A,
  kBitMode = 0x0B,
  kPins = 0x0C,
  kReadEeprom = 0x90,
};

constexpr std::uint8_t kVendorOut = 0x40, kVendorIn = 0xC0, kStandardIn = 0x80;

}  // namespace

Ft232r::Ft232r(const Ft232rSettings& settings) : settings_(settings), eeprom_(eeprom_of(settings)) {}

void Ft232r::power_up(DeviceTime now) {
  advance(now);
  *this = Ft232r(settings_);
  last_packet_ = receiver_free_ = transmitter_free_ = now;
}

std::optional<Bytes> Ft232r::control(const UsbSetup& setup, DeviceTime now) {
  advance(now);
  std::optional<Bytes> reply;
  if (setup.request_type == kVendorOut) {
    if (set(setup, now)) reply = Bytes{};
  } else if (setup.request_type == kVendorIn) {
    reply = get(setup);
  } else if (setup.request_type == kStandardIn && setup.request == 6) {
    reply = descriptor(static_cast<std::uint8_t>(setup.value >> 8U), static_cast<std::uint8_t>(setup.value & 0xFFU),
                       settings_);
  } else if ((setup.request_type & 0xE0U) == 0x80 && setup.request == 0) {
    reply = Bytes{0, 0};  // status of device, interface or endpoint
  } else if ((setup.request_type & 0xE0U) == 0 && (setup.request == 1 || setup.request == 3)) {
    reply = Bytes{};  // clear and set feature: halts that this chip never has
  }
  if (reply && reply->size() > setup.length) reply->resize(setup.length);
  return reply;
}

bool Ft232r::set(const UsbSetup& setup, DeviceTime now) {
  switch (setup.request) {
    case kReset:
      if (setup.value > 2) return false;
      // Counted from the chip: 1 is what the host had sent, 2 what the host has not fetched.
      if (setup.value != 1) purge_receive();
      if (setup.value != 2) leaving_.clear();
      if (setup.value == 0) {
        rts_ = dtr_ = false;
        event_char_.reset();
      }
      return true;
    case kModemControl:
      if ((setup.value & 0x0100U) != 0) dtr_ = (setup.value & 1U) != 0;
      if ((setup.value & 0x0200U) != 0) rts_ = (setup.value & 2U) != 0;
      return true;
    case kBaudRate:
      return set_baud(setup);
    case kEventChar:
      event_char_.reset();
      if ((setup.value & 0x0100U) != 0) event_char_ = static_cast<std::uint8_t>(setup.value & 0xFFU);
      return true;
    case kSetLatency:
      if (setup.value == 0 || setup.value > 255) return false;
      latency_ms_ = setup.value;
      last_packet_ = now;
      return true;
    case kFlowControl:
    case kData:
    case kErrorChar:
    case kBitMode:
      return true;  // accepted; the line is of three wires and the instrument of 8N1
    default:
      return false;  // above all writing and erasing the EEPROM
  }
}

bool Ft232r::set_baud(const UsbSetup& setup) {
  constexpr std::array<unsigned, 8> kEighths{0, 4, 2, 1, 3, 5, 6, 7};
  const unsigned code = (setup.value >> 14U) | (setup.index & 1U) << 2U;
  unsigned divisor = 8U * (setup.value & 0x3FFFU) + kEighths[code];
  if (code == 0 && setup.value == 0) divisor = 8;
  if (code == 0 && setup.value == 1) divisor = 12;
  if (divisor < 8) return false;
  baud_ = 24e6 / divisor;
  return true;
}

std::optional<Bytes> Ft232r::get(const UsbSetup& setup) const {
  switch (setup.request) {
    case kModemStatus: {
      const auto bytes = status();
      return Bytes(bytes.begin(), bytes.end());
    }
    case kGetLatency:
      return Bytes{static_cast<std::uint8_t>(latency_ms_)};
    case kPins:
      return Bytes{0xFF};
    case kReadEeprom: {
      const std::uint16_t word = eeprom_[setup.index % eeprom_.size()];
      return Bytes{static_cast<std::uint8_t>(word & 0xFFU), static_cast<std::uint8_t>(word >> 8U)};
    }
    default:
      return std::nullopt;
  }
}

std::array<std::uint8_t, 2> Ft232r::status() const {
  // The instrument's cable drives no modem line.
  std::uint8_t line = error_bits_;
  if (leaving_.empty()) line |= 0x40;
  if (leaving_.size() <= 1) line |= 0x20;
  return {0x01, line};
}

Duration Ft232r::byte_time() const {
  return Duration::from_seconds(10 / baud_);
}

bool Ft232r::speeds_agree() const {
  return std::abs(baud_ / settings_.line_baud - 1) < kMostMismatch;
}

std::size_t Ft232r::take(std::span<const std::uint8_t> bytes, DeviceTime now) {
  advance(now);
  std::size_t taken = 0;
  while (taken < bytes.size() && leaving_.size() < settings_.transmit_fifo_bytes)
    leaving_.push_back({bytes[taken++], now});
  return taken;
}

void Ft232r::receive(std::span<const std::uint8_t> bytes, DeviceTime now) {
  advance(now);
  for (const std::uint8_t byte : bytes) arriving_.push_back({byte, now});
}

void Ft232r::purge_receive() {
  received_.clear();
  error_bits_ = 0;
  ship_now_ = false;
}

void Ft232r::advance(DeviceTime now) {
  const Duration each = byte_time();
  const auto done = [&](std::deque<Arriving>& line, DeviceTime& free) {
    if (line.empty()) return false;
    const DeviceTime end = std::max(line.front().handed, free) + each;
    if (end > now) return false;
    free = end;
    return true;
  };
  while (done(arriving_, receiver_free_)) {
    arrive(arriving_.front().byte);
    arriving_.pop_front();
  }
  while (done(leaving_, transmitter_free_)) {
    // An instrument at another speed makes nothing of it.
    if (speeds_agree()) sent_.push_back(leaving_.front().byte);
    leaving_.pop_front();
  }
}

void Ft232r::arrive(std::uint8_t byte) {
  std::uint8_t errors = std::exchange(damage_, 0);
  if (!speeds_agree()) {
    errors |= static_cast<std::uint8_t>(LineError::framing);
    byte = static_cast<std::uint8_t>(~byte);
  }
  if ((errors & static_cast<std::uint8_t>(LineError::line_break)) != 0) byte = 0;
  if (received_.size() >= settings_.receive_fifo_bytes) errors |= static_cast<std::uint8_t>(LineError::overrun);
  error_bits_ |= errors;
  if ((errors & static_cast<std::uint8_t>(LineError::overrun)) != 0) return;
  received_.push_back(byte);
  if (event_char_ == byte) ship_now_ = true;
}

std::optional<Bytes> Ft232r::packet(DeviceTime now) {
  advance(now);
  const bool ticked = now >= last_packet_ + Duration::from_ms(latency_ms_);
  if (received_.size() < kPayload && !ticked && !ship_now_) return std::nullopt;
  const auto head = status();
  const std::size_t count = std::min(received_.size(), kPayload);
  Bytes packet(head.begin(), head.end());
  packet.insert(packet.end(), received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count));
  received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count));
  error_bits_ = 0;
  ship_now_ = false;
  last_packet_ = now;
  return packet;
}

DeviceTime Ft232r::next_packet() const {
  const DeviceTime tick = last_packet_ + Duration::from_ms(latency_ms_);
  const std::size_t lacking = kPayload - std::min(kPayload, received_.size());
  if (ship_now_ || lacking == 0) return {};
  if (arriving_.size() < lacking) return tick;
  const Duration all{byte_time().ns * static_cast<std::int64_t>(lacking)};
  return std::min(tick, std::max(arriving_[lacking - 1].handed + byte_time(), receiver_free_ + all));
}

std::optional<DeviceTime> Ft232r::next_sent() const {
  if (leaving_.empty()) return std::nullopt;
  return std::max(leaving_.front().handed, transmitter_free_) + byte_time();
}

std::vector<std::uint8_t> Ft232r::sent(DeviceTime now) {
  advance(now);
  return std::exchange(sent_, {});
}

}  // namespace birdseye::hw_sim
