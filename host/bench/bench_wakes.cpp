#include "host/bench/bench_wakes.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace birdseye::host {

namespace {

constexpr int kRate_hz = 144;

}  // namespace

Result<std::unique_ptr<TwoWakes>> TwoWakes::start() {
  auto first = Pipe::open(), second = Pipe::open();
  if (!first) return std::move(first).error();
  if (!second) return std::move(second).error();
  return std::unique_ptr<TwoWakes>(new TwoWakes(*std::move(first), *std::move(second)));
}

TwoWakes::TwoWakes(Pipe first, Pipe second) : first_(std::move(first)), second_(std::move(second)) {
  // A stamp travels; the end of the first thread closes the pipes one after the other, which ends the others: they
  // need no deadline, and what they measure is the wake alone.
  threads_.emplace_back([this](const std::stop_token& stop) {
    for (HostTime next = host_now(); !stop.stop_requested();) {
      next = next + Duration{1'000'000'000 / kRate_hz};
      sleep_until(next);
      const std::int64_t now = host_now().ns;
      if (::write(first_.in.get(), &now, sizeof now) != sizeof now) break;
    }
    first_.in = UniqueFd();
  });
  threads_.emplace_back([this](const std::stop_token&) {
    for (std::int64_t stamp = 0; ::read(first_.out.get(), &stamp, sizeof stamp) == sizeof stamp;) {
      if (::write(second_.in.get(), &stamp, sizeof stamp) != sizeof stamp) break;
    }
    second_.in = UniqueFd();
  });
  threads_.emplace_back([this](const std::stop_token&) {
    for (std::int64_t stamp = 0; ::read(second_.out.get(), &stamp, sizeof stamp) == sizeof stamp;)
      ms_.push_back(static_cast<double>(host_now().ns - stamp) * 1e-6);
  });
}

TwoWakes::~TwoWakes() {
  stop();
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
