#include "device/birdseyed/probe.hpp"

#include <fmt/core.h>

#include "device/birdseyed/tracker_thread.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::device {

namespace {

Result<std::string> probe_tracker(const TrackerConfig& config, const std::stop_token& stop) {
  const auto tracker = open_tracker(config, stop);
  if (!tracker) return tracker.error();
  const auto diagnosis = (*tracker)->diagnose(stop);
  if (!diagnosis) return diagnosis.error();
  return fmt::format("{}; it says of itself: {}", describe(**tracker, config.line.device), diagnosis->words);
}

Result<std::string> probe_camera(const drivers::CameraSettings& settings) {
  const auto camera = drivers::open_camera(settings);
  if (!camera) return camera.error();
  const Deadline deadline = Deadline::after(Duration::from_ms(2000));
  while (!deadline.passed()) {
    const auto frame = (*camera)->next(deadline);
    if (!frame) return frame.error();
    if (*frame) return (*camera)->describe();
  }
  return Error{Errc::timeout, fmt::format("{}: the camera sends no {}frames", (*camera)->name(),
                                          (*camera)->counters().incomplete > 0 ? "whole " : "")};
}

Result<std::string> probe_gpio(const drivers::GpioSettings& settings) {
  const auto lines = drivers::GpioLines::open(settings);
  if (!lines) return lines.error();
  return (*lines)->describe();
}

}  // namespace

Result<void> probe(const Config& config, const std::stop_token& stop) {
  std::string faults;
  const auto take = [&](const char* name, const Result<std::string>& found) {
    if (found) {
      fmt::print("{}: {}\n", name, *found);
    } else {
      faults += (faults.empty() ? "" : "\n") + found.error().what;
    }
  };
  take("tracker", probe_tracker(config.tracker, stop));
  take("camera", probe_camera(config.camera));
  if (!config.gpio.lines.chip.empty()) take("gpio", probe_gpio(config.gpio.lines));
  if (faults.empty()) return {};
  return Error{Errc::not_found, faults};
}

}  // namespace birdseye::device
