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
/// A message that is whole and that nobody here answers: any client may send such.
struct UnknownRequest {
  std::string type;
};
/// A message whose checksum or content is wrong.
struct DamagedRequest {
  std::string type;
};
using Request =
    std::variant<ClockPing, Subscription, CameraLock, TrackingRequest, StatusRequest, UnknownRequest, DamagedRequest>;

/// What a client sends, put together from however it comes. Bounded: no request is longer than kLargestRequest.
class RequestReader {
 public:
  static constexpr std::uint64_t kLargestRequest = 64U << 10U;

  /// The requests that are whole by now. An error is the end of the connection: its bytes are no message, and nobody
  /// can tell where the next one would begin.
  Result<std::vector<Request>> push(std::span<const std::uint8_t> bytes);
  /// A message has begun and is not whole.
  [[nodiscard]] bool waiting() const { return !buffer_.empty(); }

 private:
  std::vector<std::uint8_t> buffer_;
};

}  // namespace birdseye::wire
