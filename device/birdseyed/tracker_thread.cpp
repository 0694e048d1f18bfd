#include "device/birdseyed/tracker_thread.hpp"

#include <fmt/format.h>

#include "drivers/io/open_line.hpp"
#include "drivers/minibird/record_parser.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

namespace {

using drivers::minibird::MiniBird;

constexpr Duration kSilent = Duration::from_ms(500);  // of a unit that streams: 7 to 72 cycles

/// Until the tracker is lost; why. Bytes alone are no sign of life: another baud rate, or noise, has them too.
Error stream(MiniBird& tracker, const TrackerConfig& config, InstrumentPost& post, const std::stop_token& stop) {
  drivers::minibird::RecordParser records(tracker.layout());
  DeviceTime heard = device_now();
  bool bytes = false;  // since then
  while (!stop.stop_requested()) {
    post.alive();
    auto chunk = tracker.read(device_now() + kPatience);
    if (!chunk) return chunk.error();
    if (*chunk) {
      const bool whole = !records.push((*chunk)->bytes).empty();
      bytes = !whole;
      if (whole) heard = device_now();
      post.push(TrackerBytes{**std::move(chunk)});
    }
    if (device_now() - heard > kSilent) {
      return {Errc::timeout, fmt::format("{}: the tracker {}", config.line.device,
                                         bytes ? "sends no whole record; check its cable, and what is near it"
                                               : "has fallen silent; check its power and cable")};
    }
  }
  return {};
}

/// By the address of each bird, as the wire and the configuration count them.
std::map<std::string, std::string> identity_of(const drivers::minibird::MiniBirdInfo& info) {
  std::map<std::string, std::string> identity{{"model", info.model}};
  for (std::size_t i = 0; i < info.units.size(); ++i) {
    const auto& unit = info.units[i];
    const auto put = [&](const char* what, std::optional<int> serial) {
      if (serial) identity[fmt::format("bird{}_{}_serial", i + 1, what)] = std::to_string(*serial);
    };
    put("unit", unit.unit_serial);
    put("sensor", unit.sensor_serial);
    put("transmitter", unit.transmitter_serial);
  }
  return identity;
}

}  // namespace

Result<std::unique_ptr<MiniBird>> open_tracker(const TrackerConfig& config, const std::stop_token& stop,
                                               const std::function<void()>& still) {
  auto line = config.open_line(config.line);
  if (!line) return std::move(line).error();
  return MiniBird::start(*std::move(line), config.minibird, stop, still);
}

std::string describe(const MiniBird& tracker, const std::string& device) {
  const auto& info = tracker.info();
  return fmt::format("{}: \"{}\" {}.{}, {} bird(s), {:.2f} Hz{}{}", device, info.model, info.revision_major,
                     info.revision_minor, tracker.layout().birds.size(), info.rate_hz,
                     info.has_reset_line ? "" : ", no reset line",
                     info.latched_error.empty() ? "" : "; it had latched: " + info.latched_error);
}

void run_tracker(const TrackerConfig& config, InstrumentPost& post, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    post.alive();
    auto tracker = open_tracker(config, stop, [&post] { post.alive(); });
    if (stop.stop_requested()) return;
    if (!tracker) {
      post.tell({.state = InstrumentState::absent, .text = tracker.error().what});
      sleep_for(kLookAgain, stop);
      continue;
    }
    post.tell({.state = InstrumentState::running,
               .text = describe(**tracker, config.line.device),
               .layout = (*tracker)->layout(),
               .identity = identity_of((*tracker)->info())});
    const Error lost = stream(**tracker, config, post, stop);
    if (!stop.stop_requested()) {
      post.tell(
          {.state = lost.code == Errc::timeout ? InstrumentState::silent : InstrumentState::absent, .text = lost.what});
    }
  }
}

}  // namespace birdseye::device
