#include "hw-sim/world/frame_camera.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "drivers/io/monotonic.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kQueueFrames = 160;
constexpr std::size_t kReadyFrames = 60;

template <typename T>
void put(std::array<std::uint8_t, 64>& header, std::size_t offset, T value) {
  std::memcpy(header.data() + offset, &value, sizeof value);  // little endian, as the format is
}

}  // namespace

Result<std::unique_ptr<FrameCamera>> FrameCamera::listen(const Settings& settings, const World& world,
                                                         Laparoscope& laparoscope) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = settings.socket.string();
  if (path.size() >= sizeof address.sun_path) {
    return Error{Errc::bad_value, fmt::format("{}: too long for a socket; give a shorter --socket", path)};
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  ::unlink(path.c_str());
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || ::listen(fd, 1) != 0) {
    const int failed = errno;
    if (fd >= 0) ::close(fd);
    return Error{Errc::unreadable, fmt::format("{}: cannot be listened at; does its folder exist?", path), failed};
  }
  return std::unique_ptr<FrameCamera>(new FrameCamera(settings, world, laparoscope, fd));
}

FrameCamera::FrameCamera(Settings settings, const World& world, Laparoscope& laparoscope, int fd)
    : settings_(std::move(settings)),
      world_(world),
      laparoscope_(laparoscope),
      fd_(fd),
      frames_(static_cast<std::uint64_t>(std::ceil(world.ends_s() * settings_.rate_hz))) {
  renderer_ = std::jthread([this](const std::stop_token& stop) { render(stop); });
  server_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

FrameCamera::~FrameCamera() {
  renderer_.request_stop();
  server_.request_stop();
  changed_.notify_all();
  if (renderer_.joinable()) renderer_.join();
  if (server_.joinable()) server_.join();
  ::close(fd_);
  ::unlink(settings_.socket.c_str());
}

bool FrameCamera::ready() const {
  const std::lock_guard lock(mutex_);
  return connected_ && queue_.size() >= std::min<std::size_t>(kReadyFrames, frames_);
}

void FrameCamera::start(std::int64_t world_zero_ns) {
  zero_ns_ = world_zero_ns;
}

void FrameCamera::render(const std::stop_token& stop) {
  const Transform<Marker, Tracker> marker_from_tracker = world_.tracker_from_marker().inverse();
  const Transform<Patient, Tracker> patient_from_tracker = world_.tracker_from_patient().inverse();
  for (std::uint64_t sequence = 0; sequence < frames_; ++sequence) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [&] { return queue_.size() < kQueueFrames; });
    }
    if (stop.stop_requested()) return;
    const double world_s = static_cast<double>(sequence) / settings_.rate_hz;
    const Transform<Tracker, Camera> pose = world_.tracker_from_camera(world_s);
    Picture picture{sequence, world_.at_bench(world_s)
                                  ? laparoscope_.look_at_bench((marker_from_tracker * pose).inverse(), sequence)
                                  : laparoscope_.look_into_cavity((patient_from_tracker * pose).inverse(), sequence)};
    {
      const std::lock_guard lock(mutex_);
      queue_.push_back(std::move(picture));
    }
    changed_.notify_all();
  }
}

void FrameCamera::serve(const std::stop_token& stop) {
  int client = -1;
  while (!stop.stop_requested() && client < 0) {
    pollfd entry{fd_, POLLIN, 0};
    if (::poll(&entry, 1, 50) > 0) client = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  }
  connected_ = client >= 0;
  while (!stop.stop_requested() && zero_ns_ == 0) drivers::sleep_until({drivers::now().ns + 5'000'000});
  while (!stop.stop_requested() && sent_ < frames_) {
    Picture picture;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return !queue_.empty(); })) break;
      picture = std::move(queue_.front());
      queue_.pop_front();
    }
    changed_.notify_all();
    const double due_s = static_cast<double>(picture.sequence) / settings_.rate_hz + settings_.delivery_ms * 1e-3;
    drivers::sleep_until({zero_ns_ + static_cast<std::int64_t>(due_s * 1e9)});
    if (!send(client, picture, stop)) break;
    ++sent_;
  }
  done_ = true;
  if (client >= 0) ::close(client);
}

bool FrameCamera::send(int client, const Picture& picture, const std::stop_token& stop) const {
  std::array<std::uint8_t, 64> header{};
  std::memcpy(header.data(), "BEFRAME1", 8);
  put(header, 8, static_cast<std::uint32_t>(settings_.lens.width_px));
  put(header, 12, static_cast<std::uint32_t>(settings_.lens.height_px));
  std::memcpy(header.data() + 16, "RGB3", 4);
  put(header, 24, picture.sequence);
  put(header, 32,
      zero_ns_.load() + static_cast<std::int64_t>(static_cast<double>(picture.sequence) / settings_.rate_hz * 1e9));
  put(header, 40, std::int64_t{100'000});
  put(header, 48, static_cast<std::uint64_t>(picture.rgb.size()));
  const auto all = [&](const std::uint8_t* data, std::size_t size) {
    while (size > 0 && !stop.stop_requested()) {
      const ssize_t put_bytes = ::send(client, data, size, MSG_NOSIGNAL);
      if (put_bytes > 0) {
        data += put_bytes;
        size -= static_cast<std::size_t>(put_bytes);
      } else if (errno == EAGAIN) {
        pollfd entry{client, POLLOUT, 0};
        ::poll(&entry, 1, 50);
      } else if (errno != EINTR) {
        return false;
      }
    }
    return size == 0;
  };
  return all(header.data(), header.size()) && all(picture.rgb.data(), picture.rgb.size());
}

}  // namespace birdseye::hw_sim
