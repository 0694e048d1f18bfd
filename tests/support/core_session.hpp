#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "device/birdseyed/core.hpp"
#include "tests/support/tracker_bytes.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::testing {

inline constexpr std::int64_t kZeroNs = 1'000'000'000'000;
inline constexpr double kTrackerRateHz = 103.3, kFrameRateHz = 25;

/// A time of a session, by its seconds.
inline DeviceTime at(double seconds) {
  return {kZeroNs + static_cast<std::int64_t>(seconds * 1e9)};
}

inline drivers::Frame frame(std::uint64_t sequence, double taken_s, double arrived_s) {
  drivers::Frame f;
  f.width_px = 4;
  f.height_px = 2;
  f.rgb = std::make_shared<const std::vector<std::uint8_t>>(24, static_cast<std::uint8_t>(sequence));
  f.sequence = sequence;
  f.acquired = at(taken_s);
  f.acquired_sigma = {100'000};
  f.acquired_known = true;
  f.arrived = at(arrived_s);
  return f;
}

inline device::InstrumentChanged tracker_runs(double seconds) {
  return {.instrument = device::Instrument::tracker,
          .state = device::InstrumentState::running,
          .text = "a unit",
          .at = at(seconds),
          .layout = TrackerBytesSource::layout()};
}

inline device::InstrumentChanged camera_runs(double seconds) {
  return {.instrument = device::Instrument::camera,
          .state = device::InstrumentState::running,
          .text = "a camera",
          .at = at(seconds),
          .rate_hz = kFrameRateHz};
}

/// Tracker and camera for a while, in the order of arrival; with arrivals up to 3 ms late.
inline std::vector<device::RawEvent> session(double seconds, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> late(0, 0.003);
  TrackerBytesSource source;
  std::vector<device::RawEvent> events{tracker_runs(0), camera_runs(0)};
  double previous = 0;
  for (int i = 0; i < static_cast<int>(seconds * kTrackerRateHz); ++i) {
    const double measured = i / kTrackerRateHz;
    auto bytes = source.measure(measured);
    const double sent = measured + 0.0075 + static_cast<double>(bytes.size()) * 10 / 115200;
    previous = std::max(previous, sent + late(rng));
    events.emplace_back(device::TrackerBytes{{std::move(bytes), at(previous)}});
  }
  for (std::uint64_t n = 0; static_cast<double>(n) / kFrameRateHz < seconds; ++n) {
    const double taken = static_cast<double>(n) / kFrameRateHz;
    events.emplace_back(device::FrameCame{frame(n, taken, taken + 0.02)});
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const device::RawEvent& a, const device::RawEvent& b) { return time_of(a) < time_of(b); });
  return events;
}

inline std::vector<wire::Event> unpacked(const std::vector<wire::Packet>& packets, wire::Unpacker& unpacker) {
  std::vector<wire::Event> events;
  for (const wire::Packet& packet : packets) {
    for (const auto& message : messages_of(packet)) {
      auto told = unpacker.push(message);
      EXPECT_TRUE(told);
      if (told && *told) events.push_back(std::get<wire::Event>(**told));
    }
  }
  return events;
}

/// Everything that the core says to the events.
inline std::vector<wire::Event> told(device::Core& core, const std::vector<device::RawEvent>& events) {
  wire::Unpacker unpacker;
  std::vector<wire::Event> out;
  for (const device::RawEvent& event : events) {
    for (auto& said : unpacked(core.take(event), unpacker)) out.push_back(std::move(said));
  }
  return out;
}

template <typename T>
std::vector<T> only(const std::vector<wire::Event>& events) {
  std::vector<T> out;
  for (const wire::Event& event : events) {
    if (const auto* one = std::get_if<T>(&event)) out.push_back(*one);
  }
  return out;
}

}  // namespace birdseye::testing
