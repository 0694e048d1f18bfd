#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "calibration/base/result.hpp"
#include "device/wire/packet.hpp"

namespace birdseye::wire {

/// STT_TDATA and STP_TDATA: tracking to this client, no faster than every interval, or none.
struct TrackingRequest {
  bool start = true;
  Duration interval;
};
/// GET_STATUS.
struct StatusRequest {};
/// A whole message of a kind that the server does not answer. Any client may send such.
struct UnknownRequest {
  std::string type;
};
/// A message whose checksum or content is wrong.
struct DamagedRequest {
  std::string type;
};
using Request =
    std::variant<ClockPing, Subscription, CameraLock, TrackingRequest, StatusRequest, UnknownRequest, DamagedRequest>;

/// Puts a client's requests together from the bytes as they come. Bounded: no request is longer than kLargestRequest.
class RequestReader {
 public:
  static constexpr std::uint64_t kLargestRequest = 64U << 10U;

  /// The requests that are whole by now. After an error the connection must end: the bytes are no message, and nobody
  /// can tell where the next one would begin.
  Result<std::vector<Request>> push(std::span<const std::uint8_t> bytes);
  /// Whether a message has begun and is not whole.
  [[nodiscard]] bool waiting() const { return !buffer_.empty(); }

 private:
  std::vector<std::uint8_t> buffer_;
};

}  // namespace birdseye::wire
