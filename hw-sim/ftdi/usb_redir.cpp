#include "hw-sim/ftdi/usb_redir.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace birdseye::hw_sim {

namespace {

using Bytes = std::vector<std::uint8_t>;

enum Type : std::uint32_t {
  kHello = 0,
  kDeviceConnect = 1,
  kDeviceDisconnect = 2,
  kRedirReset = 3,
  kInterfaceInfo = 4,
  kEndpointInfo = 5,
  kSetConfiguration = 6,
  kGetConfiguration = 7,
  kConfigurationStatus = 8,
  kSetAlternate = 9,
  kGetAlternate = 10,
  kAlternateStatus = 11,
  kCancel = 21,
  kControl = 100,
  kBulk = 101,
};

enum TransferStatus : std::uint8_t { kSuccess = 0, kCancelled = 1, kInvalid = 2, kStall = 4 };

constexpr std::uint32_t kDeviceVersion = 1U << 1U, kPacketSizes = 1U << 4U, kWideIds = 1U << 5U, kLongBulk = 1U << 6U;
// QEMU's xhci takes no device over a link that lacks one of the last three.
constexpr std::uint32_t kCapabilities = kDeviceVersion | kPacketSizes | kWideIds | kLongBulk;
constexpr std::size_t kVersionBytes = 64;
constexpr std::size_t kBulkHead = 10, kControlHead = 10;
constexpr std::size_t kLargestPacket = 16U << 20U;

std::uint64_t number(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= static_cast<std::uint64_t>(bytes[at + i]) << (8 * i);
  return value;
}

std::uint16_t number16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(number(bytes, at, 2));
}

void put(Bytes& bytes, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>((value >> (8 * i)) & 0xFFU));
}

/// Endpoints are numbered 0 to 15 out, 16 to 31 in.
constexpr std::size_t kControlOut = 0, kControlIn = 16, kBulkOut = 2, kBulkIn = 17;

}  // namespace

UsbRedir::UsbRedir(Ft232r& chip) : chip_(chip) {
  Bytes hello;
  for (const char c : std::string_view("birdseye-sim ft232r")) hello.push_back(static_cast<std::uint8_t>(c));
  hello.resize(kVersionBytes, 0);
  put(hello, kCapabilities, 4);
  send(kHello, 0, hello);
}

void UsbRedir::send(std::uint32_t type, std::uint64_t id, std::span<const std::uint8_t> body) {
  put(out_, type, 4);
  put(out_, body.size(), 4);
  put(out_, id, wide_ids_ ? 8 : 4);
  out_.insert(out_.end(), body.begin(), body.end());
}

std::vector<std::uint8_t> UsbRedir::output() {
  return std::exchange(out_, {});
}

Result<void> UsbRedir::receive(std::span<const std::uint8_t> bytes, DeviceTime now) {
  in_.insert(in_.end(), bytes.begin(), bytes.end());
  std::size_t used = 0;
  while (in_.size() - used >= header_bytes()) {
    const auto head = std::span(in_).subspan(used);
    const auto type = static_cast<std::uint32_t>(number(head, 0, 4));
    const std::size_t length = number(head, 4, 4), before = header_bytes();
    if (length > kLargestPacket) return Error{Errc::bad_format, "a packet too long for usbredir; is QEMU there?"};
    if (head.size() < before + length) break;
    const std::uint64_t id = number(head, 8, before - 8);
    if (auto handled = handle(type, id, head.subspan(before, length), now); !handled) return handled;
    used += before + length;
  }
  in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(used));
  return {};
}

Result<void> UsbRedir::handle(std::uint32_t type, std::uint64_t id, std::span<const std::uint8_t> body,
                              DeviceTime now) {
  if (!greeted_ && type != kHello) return Error{Errc::bad_format, "no hello; is that QEMU's usb-redir?"};
  const auto shorter = [&](std::size_t least) { return body.size() < least; };
  switch (type) {
    case kHello:
      return greet(body, now);
    case kRedirReset:
      reads_.clear();
      writes_.clear();
      configuration_ = 0;
      break;
    case kSetConfiguration:
      if (shorter(1)) return Error{Errc::bad_format, "a request without its value"};
      configuration_ = body[0];
      [[fallthrough]];
    case kGetConfiguration:
      send(kConfigurationStatus, id, std::array<std::uint8_t, 2>{kSuccess, configuration_});
      break;
    case kSetAlternate:
    case kGetAlternate: {
      if (shorter(type == kSetAlternate ? 2 : 1)) return Error{Errc::bad_format, "a request without its value"};
      const bool known = type == kGetAlternate || body[1] == 0;
      send(kAlternateStatus, id, std::array<std::uint8_t, 3>{known ? kSuccess : kInvalid, body[0], 0});
      break;
    }
    case kCancel:
      cancel(id);
      break;
    case kControl:
      if (shorter(kControlHead)) return Error{Errc::bad_format, "a control transfer without its head"};
      control(id, body, now);
      break;
    case kBulk:
      if (shorter(kBulkHead)) return Error{Errc::bad_format, "a bulk transfer without its head"};
      bulk(id, body);
      pump(now);
      break;
    default:
      break;  // filters, acknowledgements and transfers of kinds that the chip has not
  }
  return {};
}

Result<void> UsbRedir::greet(std::span<const std::uint8_t> body, DeviceTime now) {
  const std::uint64_t theirs = body.size() >= kVersionBytes + 4 ? number(body, kVersionBytes, 4) : 0;
  if ((theirs & kCapabilities) != kCapabilities) {
    return Error{Errc::unsupported, "the other side's usbredir is too old; take QEMU 7 or later"};
  }
  greeted_ = wide_ids_ = true;
  if (plugged_) announce(now);
  return {};
}

void UsbRedir::announce(DeviceTime now) {
  chip_.power_up(now);
  configuration_ = 0;
  Bytes interfaces;
  put(interfaces, 1, 4);
  for (const std::uint8_t first :
       std::array<std::uint8_t, 4>{0x00, 0xFF, 0xFF, 0xFF}) {  // number, class, subclass, protocol
    interfaces.push_back(first);
    interfaces.resize(interfaces.size() + 31, 0);
  }
  send(kInterfaceInfo, 0, interfaces);

  constexpr std::uint8_t kNone = 255, kControlKind = 0, kBulkKind = 2;
  std::array<std::uint8_t, 32> kinds{};
  kinds.fill(kNone);
  std::array<std::uint16_t, 32> sizes{};
  for (const std::size_t endpoint : {kControlOut, kControlIn}) {
    kinds[endpoint] = kControlKind;
    sizes[endpoint] = 8;
  }
  for (const std::size_t endpoint : {kBulkOut, kBulkIn}) {
    kinds[endpoint] = kBulkKind;
    sizes[endpoint] = Ft232r::kPacket;
  }
  Bytes endpoints(kinds.begin(), kinds.end());
  endpoints.resize(3 * kinds.size(), 0);  // intervals, and the interface of each
  for (const std::uint16_t size : sizes) put(endpoints, size, 2);
  send(kEndpointInfo, 0, endpoints);

  // Full speed; class, subclass and protocol are the interface's; 0403:6001, release 6.00.
  send(kDeviceConnect, 0, std::array<std::uint8_t, 10>{1, 0, 0, 0, 0x03, 0x04, 0x01, 0x60, 0x00, 0x06});
}

void UsbRedir::unplug() {
  if (!std::exchange(plugged_, false)) return;
  reads_.clear();
  writes_.clear();
  if (greeted_) send(kDeviceDisconnect, 0, {});
}

void UsbRedir::plug(DeviceTime now) {
  if (std::exchange(plugged_, true)) return;
  if (greeted_) announce(now);
}

void UsbRedir::control(std::uint64_t id, std::span<const std::uint8_t> body, DeviceTime now) {
  const UsbSetup setup{body[2], body[1], number16(body, 4), number16(body, 6), number16(body, 8)};
  const auto data = plugged_ ? chip_.control(setup, now) : std::nullopt;
  const bool in = (setup.request_type & 0x80U) != 0;
  Bytes reply(body.begin(), body.begin() + kControlHead);
  reply[3] = data ? kSuccess : kStall;
  reply.resize(8);
  put(reply, in ? (data ? data->size() : 0) : setup.length, 2);
  if (in && data) reply.insert(reply.end(), data->begin(), data->end());
  send(kControl, id, reply);
}

void UsbRedir::bulk(std::uint64_t id, std::span<const std::uint8_t> body) {
  const std::size_t length = number16(body, 2) | static_cast<std::size_t>(number16(body, 8)) << 16U;
  Transfer transfer{id, body[0], length, {}};
  if (plugged_ && body[0] == 0x81) {
    reads_.push_back(std::move(transfer));
  } else if (plugged_ && body[0] == 0x02) {
    const auto payload = body.subspan(kBulkHead);
    transfer.bytes.assign(payload.begin(), payload.end());
    writes_.push_back(std::move(transfer));
  } else {
    complete(transfer, kStall);
  }
}

void UsbRedir::cancel(std::uint64_t id) {
  for (std::deque<Transfer>* const waiting : {&reads_, &writes_}) {
    for (auto it = waiting->begin(); it != waiting->end(); ++it) {
      if (it->id != id) continue;
      Transfer transfer = std::move(*it);
      waiting->erase(it);
      // What had been read comes along: the chip has it no more.
      complete(transfer, kCancelled);
      return;
    }
  }
}

void UsbRedir::complete(const Transfer& transfer, std::uint8_t status) {
  const bool in = (transfer.endpoint & 0x80U) != 0;
  const std::size_t length = in ? transfer.bytes.size() : transfer.length - transfer.bytes.size();
  Bytes reply{transfer.endpoint, status};
  put(reply, length & 0xFFFFU, 2);
  put(reply, 0, 4);  // of no stream
  put(reply, length >> 16U, 2);
  if (in) reply.insert(reply.end(), transfer.bytes.begin(), transfer.bytes.end());
  send(kBulk, transfer.id, reply);
}

void UsbRedir::pump(DeviceTime now) {
  if (!plugged()) return;
  while (!writes_.empty()) {
    Transfer& write = writes_.front();
    const std::size_t taken = chip_.take(write.bytes, now);
    write.bytes.erase(write.bytes.begin(), write.bytes.begin() + static_cast<std::ptrdiff_t>(taken));
    if (!write.bytes.empty()) break;  // the fifo is full
    complete(write, kSuccess);
    writes_.pop_front();
  }
  while (!reads_.empty()) {
    Transfer& read = reads_.front();
    const auto packet = chip_.packet(now);
    if (!packet) break;
    read.bytes.insert(read.bytes.end(), packet->begin(), packet->end());
    // As on the bus: a short packet ends a transfer, and so does its being full.
    if (packet->size() == Ft232r::kPacket && read.bytes.size() + Ft232r::kPacket <= read.length) continue;
    complete(read, kSuccess);
    reads_.pop_front();
  }
}

std::optional<DeviceTime> UsbRedir::next_event() const {
  std::optional<DeviceTime> next;
  if (!writes_.empty()) next = chip_.next_sent();
  if (!reads_.empty()) next = next ? std::min(*next, chip_.next_packet()) : chip_.next_packet();
  return next;
}

}  // namespace birdseye::hw_sim
