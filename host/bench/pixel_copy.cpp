#include "host/bench/pixel_copy.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/system/thread.hpp"
#include "drivers/system/unique_fd.hpp"
#include "host/bench/processor_time.hpp"

namespace birdseye::host {

namespace {

constexpr int kFrames = 40;

/// One end of a socket, over which whole frames go. Where they cannot, the other end is told, so that neither waits for
/// ever for the other.
class FrameEnd {
 public:
  explicit FrameEnd(int fd) : fd_(fd) {}

  bool send(const std::vector<std::uint8_t>& frame) const {
    constexpr std::size_t kMost = 256U << 10U;
    return all(frame.size(), [&](std::size_t at) {
      return ::send(fd_.get(), frame.data() + at, std::min(frame.size() - at, kMost), MSG_NOSIGNAL);
    });
  }
  bool receive(std::vector<std::uint8_t>& frame) const {
    return all(frame.size(),
               [&](std::size_t at) { return ::recv(fd_.get(), frame.data() + at, frame.size() - at, 0); });
  }

 private:
  template <typename Move>
  bool all(std::size_t size, Move move) const {
    for (std::size_t at = 0; at < size;) {
      const ssize_t moved = move(at);
      if (moved < 0 && errno == EINTR) continue;
      if (moved <= 0) {
        ::shutdown(fd_.get(), SHUT_RDWR);
        return false;
      }
      at += static_cast<std::size_t>(moved);
    }
    return true;
  }

  UniqueFd fd_;
};

}  // namespace

Result<double> copy_s_per_frame(std::size_t bytes, int outputs) {
  const std::vector<std::uint8_t> from(bytes, 7), theirs(bytes, 3);
  std::vector<std::uint8_t> into(bytes), there(bytes);
  double spent_s = 0;
  for (int direction = 0; direction <= outputs; ++direction) {
    std::array<int, 2> pair{-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0)
      return Error{Errc::io, "no sockets are free to measure the copying of pixels; close other programs"};
    const FrameEnd ours(pair[0]), other_end(pair[1]);
    const auto moved = [&](const FrameEnd& end, bool receive, const auto& out, auto& in) {
      bool whole = true;
      for (int i = 0; i < kFrames && whole; ++i) whole = receive ? end.receive(in) : end.send(out);
      return whole;
    };
    const bool receiving = direction == 0;
    OwnedThread other([&](const std::stop_token&) { (void)moved(other_end, !receiving, theirs, there); });
    const double before_s = thread_cpu_s();
    const bool whole = moved(ours, receiving, from, into);
    spent_s += (thread_cpu_s() - before_s) / kFrames;
    other.join();
    if (!whole) return Error{Errc::io, "pixels cannot be copied over a socket of this machine; nothing was measured"};
  }
  return spent_s;
}

}  // namespace birdseye::host
