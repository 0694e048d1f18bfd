#include "device/birdseyed/instrument_board.hpp"

namespace birdseye::device {

const char* name_of(ApplianceState state) {
  constexpr std::array kNames{"starting", "ready", "degraded"};
  return kNames[static_cast<std::size_t>(state)];
}

void InstrumentBoard::note(const InstrumentChanged& changed) {
  Entry& entry = entries_[static_cast<std::size_t>(changed.instrument)];
  const bool running = changed.state == InstrumentState::running;
  if (entry.state == InstrumentState::running && !running) ++entry.times_lost;
  entry.state = changed.state;
  entry.text = changed.text;
  if (running) entry.identity = changed.identity;
  entry.has_run = entry.has_run || running;
}

ApplianceState InstrumentBoard::state() const {
  bool all = true;
  for (const Entry& entry : entries_) {
    if (entry.state == InstrumentState::unused || entry.state == InstrumentState::running) continue;
    all = false;
    if (entry.has_run || entry.state == InstrumentState::absent) return ApplianceState::degraded;
  }
  if (all && !clock_fault_.empty()) return ApplianceState::degraded;
  return all ? ApplianceState::ready : ApplianceState::starting;
}

std::string InstrumentBoard::faults() const {
  std::string text;
  for (const Entry& entry : entries_) {
    if (entry.state == InstrumentState::unused || entry.state == InstrumentState::running) continue;
    text += (text.empty() ? "" : "; ") + entry.text;
  }
  if (!clock_fault_.empty()) text += (text.empty() ? "" : "; ") + clock_fault_;
  return text;
}

bool led_on(ApplianceState state, DeviceTime now) {
  const std::int64_t ms = now.ns / 1'000'000;
  switch (state) {
    case ApplianceState::ready:
      return true;
    case ApplianceState::starting:
      return ms % 1000 < 500;
    case ApplianceState::degraded:
      break;
  }
  return ms % 200 < 100;
}

}  // namespace birdseye::device
