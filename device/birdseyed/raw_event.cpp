#include "device/birdseyed/raw_event.hpp"

#include <array>

namespace birdseye::device {

const char* name_of(Instrument instrument) {
  constexpr std::array kNames{"tracker", "camera", "gpio"};
  return kNames[static_cast<std::size_t>(instrument)];
}

const char* name_of(InstrumentState state) {
  constexpr std::array kNames{"unused", "absent", "starting", "running", "silent"};
  return kNames[static_cast<std::size_t>(state)];
}

DeviceTime time_of(const RawEvent& event) {
  if (const auto* bytes = std::get_if<TrackerBytes>(&event)) return bytes->chunk.arrived;
  if (const auto* came = std::get_if<FrameCame>(&event)) return came->frame.arrived;
  if (const auto* edges = std::get_if<EdgesCame>(&event)) return edges->at;
  if (const auto* changed = std::get_if<InstrumentChanged>(&event)) return changed->at;
  return std::get<Tick>(event).at;
}

const char* origin_of(const RawEvent& event) {
  if (std::holds_alternative<TrackerBytes>(event)) return name_of(Instrument::tracker);
  if (std::holds_alternative<FrameCame>(event)) return name_of(Instrument::camera);
  if (std::holds_alternative<EdgesCame>(event)) return name_of(Instrument::gpio);
  if (const auto* changed = std::get_if<InstrumentChanged>(&event)) return name_of(changed->instrument);
  return nullptr;
}

}  // namespace birdseye::device
