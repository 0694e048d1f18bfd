#include "drivers/video/socket_camera.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "drivers/video/jpeg_decoder.hpp"

namespace birdseye::drivers {

namespace {

constexpr std::size_t kHeaderBytes = 64;
constexpr std::uint64_t kMostJpegOverhead = 65'536;  // a picture of noise may be more than its pixels
constexpr std::uint32_t kLargestSide = 8192;
constexpr std::uint64_t kLargestGap = 1'000'000;    // beyond it the sender began to count anew
constexpr std::int64_t kLatest_ns = 1LL << 62;      // 146 years after the start: times can be added without overflow
constexpr std::int64_t kWorstSigma_ns = 1LL << 40;  // 18 minutes

template <typename T>
T get(const std::vector<std::uint8_t>& header, std::size_t offset) {
  T value;
  std::memcpy(&value, header.data() + offset, sizeof value);
  return value;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> SocketCamera::open(const std::filesystem::path& path) {
  const std::string name = path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() >= sizeof address.sun_path) {
    return Error{Errc::bad_value, fmt::format("{}: too long for a socket; see [camera] source", name)};
  }
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  // A program whose queue is full would otherwise hold us for as long as it likes.
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd || ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Error{Errc::not_found,
                 fmt::format("{}: {}; see [camera] source", name,
                             errno == EAGAIN ? "the camera takes nobody in" : "no camera listens there")};
  }
  return std::unique_ptr<FrameSource>(new SocketCamera(std::move(fd), name));
}

std::string SocketCamera::describe() const {
  if (layout_.width_px == 0) return fmt::format("{}: a program, no frame yet", name_);
  return fmt::format("{}: a program, {} {}x{}", name_, fourcc_name(fourcc_of(layout_.format)), layout_.width_px,
                     layout_.height_px);
}

Result<bool> SocketCamera::fill(std::vector<std::uint8_t>& buffer, std::size_t& have, Deadline deadline) {
  while (have < buffer.size()) {
    if (wait_ready(fd_.get(), POLLIN, deadline) == 0) return false;
    const ssize_t got = ::recv(fd_.get(), buffer.data() + have, buffer.size() - have, MSG_DONTWAIT);
    if (got > 0) {
      have += static_cast<std::size_t>(got);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      return Error{Errc::disconnected, fmt::format("{}: the camera has gone", name_)};
    }
  }
  return true;
}

Result<std::optional<Frame>> SocketCamera::next(Deadline deadline) {
  if (!payload_) {
    header_.resize(kHeaderBytes);
    const auto whole = fill(header_, header_have_, deadline);
    if (!whole) return whole.error();
    if (!*whole) return std::optional<Frame>();
    if (auto read = read_header(); !read) return read.error();
  }
  const auto whole = fill(*payload_, payload_have_, deadline);
  if (!whole) return whole.error();
  return *whole ? finish() : std::optional<Frame>();
}

/// Nothing of it is believed before all of it makes sense.
Result<void> SocketCamera::read_header() {
  const auto width = get<std::uint32_t>(header_, 8);
  const auto height = get<std::uint32_t>(header_, 12);
  const auto format = pixel_format_of_fourcc(get<std::uint32_t>(header_, 16));
  const auto acquired_ns = get<std::int64_t>(header_, 32);
  const auto sigma_ns = get<std::int64_t>(header_, 40);
  const auto payload = get<std::uint64_t>(header_, 48);
  const bool sized = width > 0 && height > 0 && width <= kLargestSide && height <= kLargestSide &&
                     std::int64_t{width} * height <= kMostPixels;
  const bool timed = acquired_ns >= 0 && acquired_ns <= kLatest_ns && sigma_ns >= 0 && sigma_ns <= kWorstSigma_ns;
  const bool counted = get<std::uint64_t>(header_, 24) <= kMostSequence;
  bool sensible = std::memcmp(header_.data(), "BEFRAME1", 8) == 0 && format && sized && timed && counted;
  if (sensible) {
    layout_ = packed_layout(*format, static_cast<int>(width), static_cast<int>(height));
    const std::uint64_t raw = std::uint64_t{3} * width * height;
    sensible = *format == PixelFormat::mjpeg ? payload > 0 && payload <= raw + kMostJpegOverhead
                                             : payload == bytes_needed(layout_);
  }
  if (!sensible) {
    return Error{Errc::bad_format,
                 fmt::format("{}: what it sends is not a frame; see docs/manual/frame-socket.md", name_)};
  }
  payload_ = pool_.take();
  payload_->resize(payload);
  payload_have_ = 0;
  return {};
}

/// Of header and payload as they lie there; empty when the pixels are damaged.
std::optional<Frame> SocketCamera::finish() {
  Frame frame;
  frame.arrived = device_now();
  frame.width_px = layout_.width_px;
  frame.height_px = layout_.height_px;
  frame.sequence = get<std::uint64_t>(header_, 24);
  count_gap(frame.sequence);
  frame.acquired = {get<std::int64_t>(header_, 32)};
  frame.acquired_sigma = {get<std::int64_t>(header_, 40)};
  frame.acquired_known = frame.acquired.ns != 0 || frame.acquired_sigma.ns != 0;
  frame.stamp_ahead = std::max(frame.acquired - frame.arrived, Duration{});
  frame.rgb = to_pixels();
  header_have_ = 0;
  ++(frame.rgb ? counters_.frames : counters_.incomplete);
  if (!frame.rgb) return std::nullopt;
  return frame;
}

/// RGB came where it stays; all else is converted into another buffer.
std::shared_ptr<const PixelPool::Pixels> SocketCamera::to_pixels() {
  auto payload = std::move(payload_);
  if (layout_.format == PixelFormat::rgb8) return pool_.share(std::move(payload));
  auto rgb = pool_.take();
  bool whole = true;
  if (layout_.format == PixelFormat::mjpeg) {
    whole = decode_jpeg(*payload, layout_.width_px, layout_.height_px, *rgb);
  } else {
    to_rgb(*payload, layout_, *rgb);
  }
  pool_.give_back(std::move(payload));
  if (whole) return pool_.share(std::move(rgb));
  pool_.give_back(std::move(rgb));
  return nullptr;
}

void SocketCamera::count_gap(std::uint64_t sequence) {
  const std::uint64_t ahead = last_sequence_ ? sequence - *last_sequence_ : 1;
  if (ahead > 1 && ahead <= kLargestGap) counters_.gaps += ahead - 1;
  last_sequence_ = sequence;
}

}  // namespace birdseye::drivers
