#pragma once

#include <atomic>
#include <filesystem>

#include "calibration/base/result.hpp"
#include "hw-sim/video/camera_script.hpp"
#include "hw-sim/video/test_pattern.hpp"

namespace birdseye::hw_sim {

/// `birdseye-sim camera`: one of socket and device is given.
struct CameraProgram {
  std::filesystem::path socket, device;
  int width_px = 1920, height_px = 1080;
  FrameFormat format = FrameFormat::rgb3;
  bool rolling = false;          ///< rows are exposed one after another, over a frame's time
  std::filesystem::path truth;   ///< empty: none is written
  std::filesystem::path strobe;  ///< empty: the camera has none
  std::filesystem::path post;    ///< the truth of a miniBIRD on its circle: PostView is shown; empty: the test picture
  double seconds = 0;            ///< 0: until it is stopped
  CameraTiming timing;
};

/// Runs until stop, which a signal handler sets.
Result<void> run_camera(const CameraProgram& program, const std::atomic<bool>& stop);

}  // namespace birdseye::hw_sim
