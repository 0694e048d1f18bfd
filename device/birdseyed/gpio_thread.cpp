#include "device/birdseyed/gpio_thread.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

namespace {

constexpr Duration kLedStep = Duration::from_ms(50);

/// Pulses at a fixed rate, half of each period high. Late is late: a missed edge is not made up for by two at once.
class Trigger {
 public:
  explicit Trigger(double rate_hz) : half_ns_(rate_hz > 0 ? std::llround(0.5e9 / rate_hz) : 0), due_(device_now()) {}
  [[nodiscard]] DeviceTime next(DeviceTime otherwise) const {
    return half_ns_ > 0 ? std::min(due_, otherwise) : otherwise;
  }
  Result<void> step(drivers::GpioLines& lines) {
    const DeviceTime time = device_now();
    if (half_ns_ == 0 || time < due_) return {};
    high_ = !high_;
    due_ = {due_.ns + half_ns_ * (1 + (time - due_).ns / (2 * half_ns_) * 2)};
    return lines.set_trigger(high_);
  }

 private:
  std::int64_t half_ns_;
  DeviceTime due_;
  bool high_ = false;
};

Error work(drivers::GpioLines& lines, const GpioConfig& config, const std::atomic<ApplianceState>& state,
           InstrumentPost& post, const std::stop_token& stop) {
  Trigger trigger(config.trigger_rate_hz);
  bool lit = false;
  while (!stop.stop_requested()) {
    post.alive();
    auto edges = lines.read(trigger.next(device_now() + kLedStep));
    if (!edges) return edges.error();
    if (!edges->empty()) post.push(EdgesCame{*std::move(edges), device_now()});
    if (auto set = trigger.step(lines); !set) return set.error();
    const bool on = led_on(state, device_now());
    if (on == lit) continue;
    lit = on;
    if (auto set = lines.set_led(on); !set) return set.error();
  }
  (void)lines.set_led(false);
  (void)lines.set_trigger(false);
  return {};
}

}  // namespace

void run_gpio(const GpioConfig& config, const std::atomic<ApplianceState>& state, InstrumentPost& post,
              const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto lines = drivers::GpioLines::open(config.lines);
    if (lines) {
      post.tell({.state = InstrumentState::running, .text = (*lines)->describe()});
      const Error lost = work(**lines, config, state, post, stop);
      if (!stop.stop_requested()) post.tell({.state = InstrumentState::absent, .text = lost.what});
    } else {
      post.tell({.state = InstrumentState::absent, .text = lines.error().what});
    }
    lines = Error{};
    sleep_for(kLookAgain, stop);
  }
}

}  // namespace birdseye::device
