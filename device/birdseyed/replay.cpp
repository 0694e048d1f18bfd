#include "device/birdseyed/replay.hpp"

#include <spdlog/spdlog.h>

#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

Result<void> replay(const std::filesystem::path& recording, wire::Server& server, const std::stop_token& stop) {
  auto reader = RawEventReader::open(recording);
  if (!reader) return reader.error();
  Core core(reader->settings());
  std::optional<Duration> shift;  // from the recording's clock to this one
  while (!stop.stop_requested()) {
    auto event = reader->next();
    if (!event) return event.error();
    if (!*event) break;
    const DeviceTime at = time_of(**event);
    if (!shift) shift = device_now() - at;
    sleep_for(at + *shift - device_now(), stop);
    for (const wire::Packet& packet : core.take(**event)) server.publish(packet);
  }
  if (reader->cut_short()) spdlog::warn("{}: ends inside a block, as after a power cut", recording.string());
  return {};
}

}  // namespace birdseye::device
