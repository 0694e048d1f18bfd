#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "calibration/base/result.hpp"
#include "device/birdseyed/camera_thread.hpp"
#include "device/birdseyed/core.hpp"
#include "device/birdseyed/gpio_thread.hpp"
#include "device/birdseyed/record_file.hpp"
#include "drivers/io/open_line.hpp"
#include "drivers/minibird/settings.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

struct TrackerConfig {
  drivers::LineSettings line;
  /// By which the line is opened; a simulator gives its own.
  std::function<Result<std::unique_ptr<drivers::ByteStream>>(const drivers::LineSettings&)> open_line =
      drivers::open_line;
  drivers::minibird::MiniBirdSettings minibird;
  std::string reference;  ///< the bird that is fixed on patient or table, by its name; empty: there is none
};

struct WireConfig {
  std::string bind = "127.0.0.1";
  int port = 18944;
  bool allow_plain = false;  ///< beyond this machine
  bool operator==(const WireConfig&) const = default;
};

/// What birdseyed is told by its configuration file (docs/manual/birdseyed.md).
struct Config {
  std::string text;  ///< of the file
  TrackerConfig tracker;
  drivers::CameraSettings camera;
  CameraOpener open_camera = drivers::open_camera;
  GpioConfig gpio;
  WireConfig wire;
  CoreSettings core;
  /// Why no instrument fits the calibration record, with the remedy: it is bound to none. Empty: some may.
  std::string calibration_unbound;
  RecordConfig record;
};

/// Reads TOML. Whatever is wrong (unknown sections and keys, wrong types, values out of range) is told all at once, one
/// line each, "FILE:LINE: [section] key: why".
Result<Config> read_config(const std::filesystem::path& path);

}  // namespace birdseye::device
