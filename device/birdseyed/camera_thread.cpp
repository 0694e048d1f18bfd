#include "device/birdseyed/camera_thread.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "calibration/time/rate_limit.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

namespace {

constexpr int kSilentPeriods = 8;                            // frames that do not come
constexpr Duration kSilentAtLeast = Duration::from_ms(300);  // a busy machine is no silent camera
constexpr int kRestarts = 2;  // of a stream that is silent, before the camera is closed and opened again

double rate_of(const drivers::FrameSource& camera, const drivers::CameraSettings& settings) {
  return camera.rate_hz() > 0 ? camera.rate_hz() : settings.rate_hz;
}

Duration silence_of(const drivers::FrameSource& camera, const drivers::CameraSettings& settings) {
  return std::max(Duration::from_seconds(kSilentPeriods / rate_of(camera, settings)), kSilentAtLeast);
}

/// Up to four times as many frames as were agreed are read, and some at once after a halt. A program that feeds a
/// socket may send thousands a second, and then waits: their copies would leave the tracker no time.
RateLimit pace_of(const drivers::FrameSource& camera, const drivers::CameraSettings& settings) {
  constexpr double kTimes = 4;
  constexpr std::int64_t kAtOnce = 8;
  return {Duration::from_seconds(1 / (kTimes * rate_of(camera, settings))), kAtOnce};
}

/// Until the camera is lost; why.
Error stream(drivers::FrameSource& camera, const drivers::CameraSettings& settings, InstrumentPost& post,
             const ControlsLock& lock, const std::stop_token& stop) {
  bool locked = false;
  const auto running = [&] {
    post.tell({.state = InstrumentState::running,
               .text = camera.describe() + (locked ? ", controls held" : ""),
               .rate_hz = camera.rate_hz(),
               .exposure = camera.exposure(),
               .identity = camera.identity()});
  };
  const Duration silence = silence_of(camera, settings);
  RateLimit pace = pace_of(camera, settings);
  DeviceTime heard = device_now();
  std::optional<std::uint64_t> newest;
  int restarts = 0;
  bool known = false;  // to run: a program that feeds a socket says what it sends with its first frame only
  while (!stop.stop_requested()) {
    post.alive();
    if (lock.wanted() != locked) {
      locked = !locked;
      lock.tell(locked, locked ? camera.lock_controls() : camera.unlock_controls());
      if (known) running();  // its exposure is known now, or no longer
    }
    if (const Duration early = pace.free_at() - device_now(); early > Duration{}) sleep_for(early, stop);
    const std::uint64_t incomplete = camera.counters().incomplete;
    auto frame = camera.next(device_now() + kPatience);
    if (!frame) return frame.error();
    const bool came = frame->has_value(), damaged = camera.counters().incomplete != incomplete;
    if (came || damaged) pace.passed(device_now());
    if (came) {
      if (std::exchange(restarts, 0) > 0 || !std::exchange(known, true)) running();
      // One frame over and over is no stream.
      if (std::exchange(newest, (*frame)->sequence) != (*frame)->sequence) heard = device_now();
      post.push(FrameCame{**std::move(frame)});
    }
    if (device_now() - heard > silence) {
      const std::string text = fmt::format("{}: the camera sends no {}frames", camera.name(), came ? "new " : "");
      if (restarts++ == kRestarts) return {Errc::timeout, text};
      post.tell({.state = InstrumentState::silent, .text = text});
      if (auto restarted = camera.restart_stream(); !restarted) return restarted.error();
      heard = device_now();
    }
  }
  return {};
}

}  // namespace

void run_camera(const drivers::CameraSettings& settings, const CameraOpener& open, InstrumentPost& post,
                const ControlsLock& lock, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto camera = open(settings);
    if (!camera) {
      post.tell({.state = InstrumentState::absent, .text = camera.error().what});
    } else if (const Error lost = stream(**camera, settings, post, lock, stop); !stop.stop_requested()) {
      post.tell(
          {.state = lost.code == Errc::timeout ? InstrumentState::silent : InstrumentState::absent, .text = lost.what});
    }
    camera = Error{};  // closed before it is looked for again
    sleep_for(kLookAgain, stop);
  }
}

}  // namespace birdseye::device
