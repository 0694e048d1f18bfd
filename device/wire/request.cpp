#include "device/wire/request.hpp"

#include <nlohmann/json.hpp>

#include "device/wire/igtl_bytes.hpp"
#include "device/wire/json.hpp"

namespace birdseye::wire {

namespace {

/// What a client asks in JSON takes a tenth of that. To parse what a flood sends beyond it takes time that poses need.
constexpr std::size_t kMostJsonBytes = 1024;

Request string_request(const Header& header, std::span<const std::uint8_t> body) {
  const auto text = text_of_string(header, body);
  if (!text || text->size() > kMostJsonBytes) return DamagedRequest{header.type};
  try {
    if (header.device == kClockPingDevice) return nlohmann::json::parse(*text).get<ClockPing>();
    if (header.device == kSubscribeDevice) return nlohmann::json::parse(*text).get<Subscription>();
    if (header.device == kCameraLockDevice) return nlohmann::json::parse(*text).get<CameraLock>();
  } catch (const nlohmann::json::exception&) {
    return DamagedRequest{header.type};
  }
  return UnknownRequest{header.type};
}

Request request_of(const Header& header, std::span<const std::uint8_t> body) {
  if (checksum(body) != header.crc) return DamagedRequest{header.type};
  if (header.type == "STRING") return string_request(header, body);
  if (header.type == "STP_TDATA") return TrackingRequest{false, {}};
  if (header.type == "STT_TDATA") {
    // Resolution, ms, big endian; the name of a coordinate system, of which there is one here.
    const std::size_t content = content_bytes(header, body);
    if (content < 4) return DamagedRequest{header.type};
    const auto at = body.subspan(body.size() - content);
    const std::uint32_t ms =
        std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U | at[3];
    return TrackingRequest{true, Duration::from_ms(ms)};
  }
  if (header.type == "GET_STATUS") return StatusRequest{};
  return UnknownRequest{header.type};
}

}  // namespace

Result<std::vector<Request>> RequestReader::push(std::span<const std::uint8_t> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  std::vector<Request> requests;
  std::size_t done = 0;
  while (buffer_.size() - done >= kHeaderBytes) {
    const std::span rest = std::span(buffer_).subspan(done);
    const auto header = read_header(rest, kLargestRequest);
    if (!header) return header.error();
    const std::size_t size = kHeaderBytes + static_cast<std::size_t>(header->body_bytes);
    if (rest.size() < size) break;
    requests.push_back(request_of(*header, rest.subspan(kHeaderBytes, size - kHeaderBytes)));
    done += size;
  }
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(done));
  return requests;
}

}  // namespace birdseye::wire
