#include "drivers/video/socket_camera.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

#include "drivers/io/monotonic.hpp"
#include "drivers/video/pixel_format.hpp"

namespace birdseye::drivers {

namespace {

constexpr std::size_t kHeaderBytes = 64;
constexpr std::uint32_t kLargestSide = 8192;

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
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!fd || ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Error{Errc::not_found, fmt::format("{}: no camera listens there; see [camera] source", name), errno};
  }
  return std::unique_ptr<FrameSource>(new SocketCamera(std::move(fd), name));
}

std::string SocketCamera::describe() const {
  return fmt::format("{}: frames from a program", name_);
}

Result<bool> SocketCamera::fill(std::vector<std::uint8_t>& buffer, std::size_t& have, DeviceTime deadline) {
  while (have < buffer.size()) {
    pollfd entry{fd_.get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, poll_ms(deadline));
    if (ready == 0 && now() >= deadline) return false;
    if (ready <= 0) continue;
    const ssize_t got = ::recv(fd_.get(), buffer.data() + have, buffer.size() - have, MSG_DONTWAIT);
    if (got > 0) {
      have += static_cast<std::size_t>(got);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      return Error{Errc::disconnected, fmt::format("{}: the camera has gone", name_)};
    }
  }
  return true;
}

Result<std::optional<Frame>> SocketCamera::next(DeviceTime deadline) {
  header_.resize(kHeaderBytes);
  auto whole = fill(header_, header_have_, deadline);
  if (!whole) return whole.error();
  if (!*whole) return std::optional<Frame>();
  const auto width = get<std::uint32_t>(header_, 8);
  const auto height = get<std::uint32_t>(header_, 12);
  const auto format = pixel_format_of_fourcc(get<std::uint32_t>(header_, 16));
  const auto payload = get<std::uint64_t>(header_, 48);
  const bool sized = width > 0 && height > 0 && width <= kLargestSide && height <= kLargestSide &&
                     std::int64_t{width} * height <= kMostPixels;
  if (std::memcmp(header_.data(), "BEFRAME1", 8) != 0 || !format || !sized ||
      payload != std::uint64_t{width} * height * bytes_per_pixel(*format)) {
    return Error{Errc::bad_format,
                 fmt::format("{}: what it sends is not a frame; see docs/manual/frame-socket.md", name_)};
  }
  pixels_.resize(payload);
  whole = fill(pixels_, pixels_have_, deadline);
  if (!whole) return whole.error();
  if (!*whole) return std::optional<Frame>();

  Frame frame;
  frame.arrived = now();
  frame.width_px = static_cast<int>(width);
  frame.height_px = static_cast<int>(height);
  frame.sequence = get<std::uint64_t>(header_, 24);
  frame.acquired = {get<std::int64_t>(header_, 32)};
  frame.acquired_sigma = {get<std::int64_t>(header_, 40)};
  frame.acquired_known = frame.acquired.ns != 0 || frame.acquired_sigma.ns != 0;
  if (*format == PixelFormat::rgb8) {
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels_));
  } else {
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(
        to_rgb(pixels_, *format, frame.width_px, frame.height_px, width * bytes_per_pixel(*format)));
  }
  pixels_ = {};
  header_have_ = pixels_have_ = 0;
  ++counters_.frames;
  return std::optional<Frame>(std::move(frame));
}

}  // namespace birdseye::drivers
