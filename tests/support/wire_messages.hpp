#pragma once

#include <igtl_util.h>

#include <cstdint>
#include <vector>

#include "device/wire/igtl_bytes.hpp"
#include "device/wire/unpacker.hpp"

namespace birdseye::testing {

/// The messages that a packet is made of.
inline std::vector<std::vector<std::uint8_t>> messages_of(const wire::Packet& packet) {
  const auto bytes = packet.bytes();
  std::vector<std::vector<std::uint8_t>> messages;
  for (std::size_t from = 0; from < bytes.size();) {
    const auto rest = std::span(bytes).subspan(from);
    const std::size_t size = wire::kHeaderBytes + static_cast<std::size_t>(*wire::body_bytes(rest));
    messages.emplace_back(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(size));
    from += size;
  }
  return messages;
}

/// Body size and checksum made to fit what is there, by the protocol's own library: only what the body says can still
/// betray damage.
inline std::vector<std::uint8_t> made_plausible(std::vector<std::uint8_t> message) {
  const std::uint64_t body = message.size() - wire::kHeaderBytes;
  const std::uint64_t crc = crc64(message.data() + wire::kHeaderBytes, body, 0);
  for (std::size_t i = 0; i < 8; ++i) {
    message[42 + i] = static_cast<std::uint8_t>(body >> (56 - 8 * i));
    message[50 + i] = static_cast<std::uint8_t>(crc >> (56 - 8 * i));
  }
  return message;
}

}  // namespace birdseye::testing
