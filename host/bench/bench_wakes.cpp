#include "host/bench/bench_wakes.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace birdseye::host {

namespace {

constexpr int kRate_hz = 144;

}  // namespace

Result<std::unique_ptr<TwoWakes>> TwoWakes::start() {
  std::array<int, 4> ends{};
  if (::pipe2(&ends[0], O_CLOEXEC) != 0) return Error{Errc::unreadable, "no pipe can be opened"};
  if (::pipe2(&ends[2], O_CLOEXEC) != 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    return Error{Errc::unreadable, "no pipe can be opened"};
  }
  return std::unique_ptr<TwoWakes>(new TwoWakes(ends));
}

TwoWakes::TwoWakes(const std::array<int, 4>& ends) : ends_(ends) {
  // A stamp travels; the end of the first thread closes the pipes one after the other, which ends the others.
  threads_.emplace_back([this](const std::stop_token& stop) {
    for (HostTime next = host_now(); !stop.stop_requested();) {
      next = next + Duration{1'000'000'000 / kRate_hz};
      sleep_until(next);
      const std::int64_t now = host_now().ns;
      if (::write(ends_[1], &now, sizeof now) != sizeof now) break;
    }
    ::close(ends_[1]);
  });
  threads_.emplace_back([this](const std::stop_token&) {
    for (std::int64_t stamp = 0; ::read(ends_[0], &stamp, sizeof stamp) == sizeof stamp;) {
      if (::write(ends_[3], &stamp, sizeof stamp) != sizeof stamp) break;
    }
    ::close(ends_[3]);
  });
  threads_.emplace_back([this](const std::stop_token&) {
    for (std::int64_t stamp = 0; ::read(ends_[2], &stamp, sizeof stamp) == sizeof stamp;)
      ms_.push_back(static_cast<double>(host_now().ns - stamp) * 1e-6);
  });
}

TwoWakes::~TwoWakes() {
  stop();
  ::close(ends_[0]);
  ::close(ends_[2]);
}

std::vector<double> TwoWakes::stop() {
  for (OwnedThread& thread : threads_) {
    thread.request_stop();
    thread.join();
  }
  std::vector<double> p99_ms;
  for (auto second = ms_.begin(); ms_.end() - second >= kRate_hz; second += kRate_hz) {
    const auto at = second + kRate_hz * 99 / 100;
    std::nth_element(second, at, second + kRate_hz);
    p99_ms.push_back(*at);
  }
  return p99_ms;
}

}  // namespace birdseye::host
