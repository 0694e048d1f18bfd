#include "device/birdseyed/instrument_thread.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "drivers/system/clock.hpp"

namespace birdseye::device {

void InstrumentPost::tell(InstrumentChanged changed) {
  alive();
  if (changed.state == state_ && changed.text == text_) return;
  state_ = changed.state;
  text_ = changed.text;
  changed.instrument = instrument_;
  changed.at = device_now();
  const bool good = state_ == InstrumentState::running || state_ == InstrumentState::starting;
  spdlog::log(good ? spdlog::level::info : spdlog::level::warn, "{} {}: {}", name_of(instrument_), name_of(state_),
              text_);
  push(std::move(changed));
}

void InstrumentPost::alive() {
  alive_ns_ = device_now().ns;
}

}  // namespace birdseye::device
