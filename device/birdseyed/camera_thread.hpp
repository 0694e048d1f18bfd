#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

/// Whether a client wants the camera's exposure, gain, white balance and focus held, and where to say what became of
/// that.
struct ControlsLock {
  std::function<bool()> wanted = [] { return false; };
  std::function<void(bool locked, const drivers::ControlReport&)> tell = [](bool, const drivers::ControlReport&) {};
};

/// By which a camera is opened: drivers::open_camera, or a simulator's own.
using CameraOpener = std::function<Result<std::unique_ptr<drivers::FrameSource>>(const drivers::CameraSettings&)>;

/// Finds the camera, hands over its frames, and begins again when it is lost. Returns at stop.
void run_camera(const drivers::CameraSettings& settings, const CameraOpener& open, InstrumentPost& post,
                const ControlsLock& lock, const std::stop_token& stop);

}  // namespace birdseye::device
