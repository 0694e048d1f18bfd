#include "drivers/video/v4l2_controls.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace birdseye::drivers {

namespace {

constexpr double kExposureUnit_us = 100;

}  // namespace

/// Something that a camera changes by itself: what switches that off, and the values it changes (0: no more).
struct V4l2Controls::Automatism {
  const char* name;
  std::uint32_t id;
  std::array<int, 2> off;  // the second, where the camera does not take the first
  std::array<std::uint32_t, 3> values;
};

const V4l2Controls::Automatism V4l2Controls::kAutomatisms[] = {
    {"exposure",
     V4L2_CID_EXPOSURE_AUTO,
     {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY},
     {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE, 0}},
    {"gain", V4L2_CID_AUTOGAIN, {0, 0}, {V4L2_CID_GAIN, V4L2_CID_ANALOGUE_GAIN, 0}},
    {"white balance",
     V4L2_CID_AUTO_WHITE_BALANCE,
     {0, 0},
     {V4L2_CID_WHITE_BALANCE_TEMPERATURE, V4L2_CID_RED_BALANCE, V4L2_CID_BLUE_BALANCE}},
    {"focus", V4L2_CID_FOCUS_AUTO, {0, 0}, {V4L2_CID_FOCUS_ABSOLUTE, 0, 0}},
    // In the dark some cameras slow down to expose for longer.
    {"frame rate in the dark", V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0, 0}, {0, 0, 0}},
};

std::string V4l2Controls::value_text(std::uint32_t id, int value) {
  if (id == V4L2_CID_EXPOSURE_ABSOLUTE) return fmt::format("{:g} us", value * kExposureUnit_us);
  if (id == V4L2_CID_WHITE_BALANCE_TEMPERATURE) return fmt::format("{} K", value);
  return fmt::format("{}", value);
}

Result<void> V4l2Controls::switch_off(const Automatism& automatism) {
  if (!port_.range(automatism.id)) return {};
  Result<void> set;
  for (const int off : automatism.off) {
    set = port_.set(automatism.id, off);
    if (set && port_.get(automatism.id) == off) return {};
  }
  return set ? Result<void>(Error{Errc::unsupported, "the camera goes on changing it by itself"}) : set;
}

void V4l2Controls::hold(const Automatism& automatism, ControlReport& report) {
  const auto was = port_.get(automatism.id);
  if (!was || *was == automatism.off[0] || *was == automatism.off[1]) return;
  std::map<std::uint32_t, int> values;
  for (const std::uint32_t id : automatism.values) {
    if (id == 0 || !port_.range(id)) continue;
    if (const auto value = port_.get(id)) values[id] = *value;
  }
  if (auto off = switch_off(automatism); !off) {
    report.refused.push_back(fmt::format("{}: {}", automatism.name, off.error().what));
    return;
  }
  before_lock_[automatism.id] = *was;
  std::string held;
  for (const auto& [id, value] : values) {
    if (auto set = port_.set(id, value); !set) {
      report.refused.push_back(fmt::format("{}: {}", automatism.name, set.error().what));
      continue;
    }
    held += (held.empty() ? " at " : ", ") + value_text(id, port_.get(id).value_or(value));
  }
  report.done.push_back(fmt::format("{} held{}", automatism.name, held));
}

ControlReport V4l2Controls::lock() {
  ControlReport report;
  for (const Automatism& automatism : kAutomatisms) hold(automatism, report);
  return report;
}

ControlReport V4l2Controls::unlock() {
  ControlReport report;
  for (const Automatism& automatism : kAutomatisms) {
    const auto was = before_lock_.find(automatism.id);
    if (was == before_lock_.end()) continue;
    if (auto set = port_.set(automatism.id, was->second); !set) {
      report.refused.push_back(fmt::format("{}: {}", automatism.name, set.error().what));
    } else {
      report.done.push_back(fmt::format("{} automatic again", automatism.name));
    }
  }
  before_lock_.clear();
  return report;
}

/// The first value control that the camera has, to value; its automatism off.
void V4l2Controls::set_value(const Automatism& automatism, int value, ControlReport& report) {
  const std::uint32_t id = automatism.values[0];
  const auto range = port_.range(id);
  const auto refuse = [&](const std::string& why) {
    report.refused.push_back(fmt::format("{} {}: {}", automatism.name, value_text(id, value), why));
  };
  if (!range) return refuse("the camera has no such control");
  if (value < range->least || value > range->most) {
    return refuse(fmt::format("the camera takes {} to {}", value_text(id, range->least), value_text(id, range->most)));
  }
  if (auto off = switch_off(automatism); !off) return refuse(off.error().what);
  if (auto set = port_.set(id, value); !set) return refuse(set.error().what);
  report.done.push_back(fmt::format("{} {}", automatism.name, value_text(id, port_.get(id).value_or(value))));
}

ControlReport V4l2Controls::apply(const CameraSettings& settings) {
  ControlReport report;
  if (settings.exposure_us) {
    const double units = std::clamp(*settings.exposure_us / kExposureUnit_us, 0.0, 1e9);
    set_value(kAutomatisms[0], std::max(1, static_cast<int>(std::lround(units))), report);
  }
  if (settings.gain) set_value(kAutomatisms[1], *settings.gain, report);
  if (settings.white_balance_k) set_value(kAutomatisms[2], *settings.white_balance_k, report);
  return report;
}

std::optional<Duration> V4l2Controls::exposure() {
  const auto automatic = port_.get(V4L2_CID_EXPOSURE_AUTO);
  if (automatic && *automatic != V4L2_EXPOSURE_MANUAL && *automatic != V4L2_EXPOSURE_SHUTTER_PRIORITY) {
    return std::nullopt;
  }
  const auto units = port_.get(V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!units || *units <= 0) return std::nullopt;
  return Duration{std::llround(*units * kExposureUnit_us * 1000)};
}

}  // namespace birdseye::drivers
