#include "drivers/gpio/debouncer.hpp"

namespace birdseye::drivers {

void Debouncer::push(bool active, DeviceTime at) {
  if (edges_ == 0) began_ = at;
  ++edges_;
  level_ = active;
  last_edge_ = at;
}

std::optional<DeviceTime> Debouncer::due() const {
  if (edges_ == 0) return std::nullopt;
  return last_edge_ + hold_;
}

std::optional<Debouncer::Change> Debouncer::settle(DeviceTime now) {
  if (edges_ == 0 || now < last_edge_ + hold_) return std::nullopt;
  const std::uint64_t burst = edges_;
  edges_ = 0;
  if (level_ == settled_) {
    bounces_ += burst;
    return std::nullopt;
  }
  bounces_ += burst - 1;
  settled_ = level_;
  return Change{settled_, began_};
}

}  // namespace birdseye::drivers
