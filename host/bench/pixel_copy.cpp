#include "host/bench/pixel_copy.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "drivers/system/thread.hpp"
#include "host/bench/processor_time.hpp"

namespace birdseye::host {

double copy_s_per_frame(std::size_t bytes, int outputs) {
  constexpr int kFrames = 40;
  std::vector<std::uint8_t> from(bytes, 7), into(bytes);
  double spent_s = 0;
  for (int direction = 0; direction <= outputs; ++direction) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) return 0;
    std::vector<std::uint8_t> theirs(bytes, 3);
    const auto send_all = [&](int fd, const std::vector<std::uint8_t>& data) {
      for (std::size_t at = 0; at < data.size();) {
        const ssize_t put = ::send(fd, data.data() + at, std::min<std::size_t>(data.size() - at, 256U << 10U), 0);
        if (put <= 0) return;
        at += static_cast<std::size_t>(put);
      }
    };
    const auto receive_all = [&](int fd, std::vector<std::uint8_t>& data) {
      for (std::size_t at = 0; at < data.size();) {
        const ssize_t got = ::recv(fd, data.data() + at, data.size() - at, 0);
        if (got <= 0) return;
        at += static_cast<std::size_t>(got);
      }
    };
    OwnedThread other([&](const std::stop_token&) {
      for (int i = 0; i < kFrames; ++i) direction == 0 ? send_all(pair[1], theirs) : receive_all(pair[1], theirs);
    });
    const double before_s = thread_cpu_s();
    for (int i = 0; i < kFrames; ++i) direction == 0 ? receive_all(pair[0], into) : send_all(pair[0], from);
    spent_s += (thread_cpu_s() - before_s) / kFrames;
    other.join();
    ::close(pair[0]);
    ::close(pair[1]);
  }
  return spent_s;
}

}  // namespace birdseye::host
