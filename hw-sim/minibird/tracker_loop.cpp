#include "hw-sim/minibird/tracker_loop.hpp"

#include <sys/prctl.h>

#include <algorithm>
#include <utility>

#include "drivers/system/clock.hpp"

namespace birdseye::hw_sim {

TrackerLoop::TrackerLoop(std::unique_ptr<Endpoint> endpoint, TrackerScript script, Listeners listeners)
    : endpoint_(std::move(endpoint)), script_(std::move(script)), listeners_(std::move(listeners)) {
  thread_ = OwnedThread([this](const std::stop_token& stop) { run(stop); });
}

void TrackerLoop::follow_plug() {
  if (script_.plugged() == plugged_) return;
  if (plugged_) {
    endpoint_->unplug();
    plugged_ = false;
  } else {
    plugged_ = endpoint_->replug().has_value();  // else again the next time round
  }
}

void TrackerLoop::report() {
  for (const FaultEvent& event : script_.take_events()) {
    if (listeners_.on_fault) listeners_.on_fault(event);
  }
  if (const double rate = script_.rate_hz(); rate != rate_hz_) {
    rate_hz_ = rate;
    if (listeners_.on_rate) listeners_.on_rate(rate);
  }
  if (const int count = script_.unit().violations(); count != violations_) {
    violations_ = count;
    if (listeners_.on_violation && count > 0) listeners_.on_violation(count);
  }
  streaming_ = script_.streaming();
}

void TrackerLoop::run(const std::stop_token& stop) {
  constexpr std::int64_t kLongestWaitNs = 20'000'000;
  ::prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);  // records leave on time, not when it suits the power supply
  while (!stop.stop_requested()) {
    if (const std::int64_t zero_ns = align_ns_.exchange(0); zero_ns != 0) script_.align(zero_ns);
    const auto bytes = endpoint_->read();
    const std::int64_t now_ns = device_now().ns;
    if (!bytes.empty()) script_.receive(bytes, now_ns);
    for (const Delivery& delivery : script_.advance(now_ns)) endpoint_->write(delivery.bytes);
    follow_plug();
    report();
    endpoint_->wait(std::min(script_.next_ns(), now_ns + kLongestWaitNs));
  }
}

}  // namespace birdseye::hw_sim
