#include "host/link/event_bytes.hpp"

namespace birdseye::host {

namespace {

std::size_t texts_of(const wire::VideoFrame& frame) {
  return frame.rgb ? frame.rgb->size() : 0;
}
std::size_t texts_of(const wire::Birds& birds) {
  std::size_t bytes = birds.birds.size() * sizeof(wire::Bird);
  for (const wire::Bird& bird : birds.birds) bytes += bird.name.size();
  return bytes;
}
std::size_t texts_of(const wire::Doubt& doubt) {
  return doubt.bird.size() + doubt.why.size();
}
std::size_t texts_of(const wire::ClockChange& change) {
  return change.clock.size() + change.kind.size();
}
std::size_t texts_of(const wire::Pedal& /*pedal*/) {
  return 0;
}
std::size_t texts_of(const wire::Status& status) {
  return status.text.size();
}
std::size_t texts_of(const wire::Health& health) {
  std::size_t bytes = health.recording.size() + health.reference.size() + health.field_unsigned.size();
  for (const wire::InstrumentHealth& instrument : health.instruments) {
    bytes += sizeof instrument + instrument.text.size();
    for (const auto& [key, value] : instrument.identity) bytes += key.size() + value.size();
  }
  return bytes;
}
std::size_t texts_of(const wire::CameraControls& controls) {
  std::size_t bytes = 0;
  for (const auto* lines : {&controls.done, &controls.refused}) {
    for (const std::string& line : *lines) bytes += sizeof(std::string) + line.size();
  }
  return bytes;
}
std::size_t texts_of(const wire::Calibration& calibration) {
  return calibration.why_not.size() + calibration.record.size();
}

}  // namespace

std::size_t bytes_of(const wire::Event& event) {
  return sizeof event + std::visit([](const auto& one) { return texts_of(one); }, event);
}

}  // namespace birdseye::host
