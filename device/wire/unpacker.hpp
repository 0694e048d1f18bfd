#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "calibration/base/result.hpp"
#include "device/wire/packet.hpp"

namespace birdseye::wire {

inline constexpr std::uint64_t kLargestBody = 64U << 20U;

/// The size of the body that follows a header; refuses what is no header, and bodies over kLargestBody.
Result<std::uint64_t> body_bytes(std::span<const std::uint8_t> header);

/// Puts messages back together: a FrameInfo is held until its image comes. Messages that are not ours are passed over.
class Unpacker {
 public:
  using Told = std::variant<Event, ClockPong>;
  /// message: header and body. Empty where the message completes nothing.
  Result<std::optional<Told>> push(std::span<const std::uint8_t> message);

 private:
  Result<std::optional<Told>> push_string(const std::string& device, const std::string& text);
  std::optional<FrameInfo> info_;
};

}  // namespace birdseye::wire
