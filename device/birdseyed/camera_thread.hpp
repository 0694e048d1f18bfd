#pragma once

#include <stop_token>

#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

/// Finds the camera and hands over its frames, and begins again when it is lost. Until stop.
void run_camera(const drivers::CameraSettings& settings, InstrumentPost& post, const std::stop_token& stop);

}  // namespace birdseye::device
