#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/pose_history.hpp"
#include "drivers/minibird/minibird.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

/// What birdseyed is told by its configuration file (docs/manual/birdseyed.md).
struct Config {
  std::filesystem::path tracker_device;
  drivers::minibird::MiniBirdSettings tracker;
  std::vector<std::string> bird_names;  ///< one per bird; the first is the scope's
  drivers::CameraSettings camera;
  std::string bind = "127.0.0.1";
  int port = 18944;
  PoseHistory::Settings pose;
};

/// Reads TOML. An unknown section or key, a value of the wrong type or out of its range is an error that names the file
/// and the setting.
Result<Config> read_config(const std::filesystem::path& path);

}  // namespace birdseye::device
