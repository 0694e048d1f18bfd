#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <vector>

#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/base/listener.hpp"
#include "hw-sim/video/frame_sink.hpp"

namespace birdseye::hw_sim {

namespace {

using FrameHeader = std::array<std::uint8_t, 64>;

template <typename T>
void put(FrameHeader& header, std::size_t offset, T value) {
  std::memcpy(header.data() + offset, &value, sizeof value);  // little endian, as the format is
}

FrameHeader header_of(const FramePlan& plan, const FramePixels& picture) {
  FrameHeader header{};
  std::memcpy(header.data(), "BEFRAME1", 8);
  put(header, 8, static_cast<std::uint32_t>(picture.width_px));
  put(header, 12, static_cast<std::uint32_t>(picture.height_px));
  std::memcpy(header.data() + 16, fourcc_of(picture.format).data(), 4);
  put(header, 24, plan.sequence);
  put(header, 32, plan.stamp_ns);
  put(header, 40, plan.sigma_ns);
  put(header, 48, static_cast<std::uint64_t>(picture.pixels.size()));
  return header;
}

class FrameSocket final : public FrameSink {
 public:
  FrameSocket(UniqueFd listener, std::filesystem::path path, std::uint64_t seed)
      : listener_(std::move(listener)), path_(std::move(path)), seed_(seed) {}
  ~FrameSocket() override { ::unlink(path_.c_str()); }

  [[nodiscard]] bool connected() const override { return static_cast<bool>(reader_); }
  [[nodiscard]] bool busy() const override { return !left_.empty(); }

  void begin(const FramePlan& plan, const FramePixels& picture) override {
    if (!reader_) return;
    garbage_.resize(plan.garbage_bytes);
    for (std::size_t i = 0; i < garbage_.size(); ++i) {
      garbage_[i] = static_cast<std::uint8_t>(hashed_word(seed_ + 123, plan.number * 4096 + i) & 0xFFU);
    }
    header_ = header_of(plan, picture);
    const auto bytes = static_cast<std::size_t>(plan.part * static_cast<double>(picture.pixels.size()));
    if (!garbage_.empty()) left_.emplace_back(garbage_);
    for (int copy = 0; copy < plan.copies; ++copy) {
      left_.emplace_back(header_);
      left_.push_back(picture.pixels.first(bytes));
    }
    push();
  }

  void work(std::int64_t until_ns) override {
    const bool stuck = busy();
    const int fd = reader_ ? reader_.get() : listener_.get();
    const auto events = static_cast<short>(stuck ? POLLIN | POLLOUT : POLLIN);
    if (wait_ready(fd, events, DeviceTime{until_ns}) == 0) return;
    if (!reader_ && listener_) {
      reader_ = UniqueFd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      const int bytes = 4 << 20;
      ::setsockopt(reader_.get(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
      return;
    }
    // Readers say nothing: that they can be read from means that they have gone.
    std::array<std::uint8_t, 64> ignored;
    const ssize_t got = reader_ ? ::recv(reader_.get(), ignored.data(), ignored.size(), 0) : 1;
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) hang_up();
    push();
  }

  void unplug() override {
    hang_up();
    listener_ = UniqueFd();
    ::unlink(path_.c_str());
  }
  Result<void> replug() override {
    auto listener = listen_at_path(path_);
    if (!listener) return listener.error();
    listener_ = *std::move(listener);
    return {};
  }

 private:
  void hang_up() {
    reader_ = UniqueFd();
    left_.clear();
  }
  void push() {
    while (reader_ && !left_.empty()) {
      auto& part = left_.front();
      if (part.empty()) {
        left_.pop_front();
        continue;
      }
      const ssize_t sent = ::send(reader_.get(), part.data(), part.size(), MSG_NOSIGNAL);
      if (sent > 0) {
        part = part.subspan(static_cast<std::size_t>(sent));
      } else if (errno == EAGAIN) {
        return;
      } else if (errno != EINTR) {
        hang_up();
      }
    }
  }

  UniqueFd listener_, reader_;
  std::filesystem::path path_;
  std::uint64_t seed_;
  FrameHeader header_{};
  std::vector<std::uint8_t> garbage_;
  std::deque<std::span<const std::uint8_t>> left_;  ///< of the frame in hand
};

}  // namespace

Result<std::unique_ptr<FrameSink>> listen_for_frames(const std::filesystem::path& path, std::uint64_t seed) {
  auto listener = listen_at_path(path);
  if (!listener) return listener.error();
  return std::unique_ptr<FrameSink>(std::make_unique<FrameSocket>(*std::move(listener), path, seed));
}

}  // namespace birdseye::hw_sim
