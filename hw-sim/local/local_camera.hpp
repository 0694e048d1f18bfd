#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/video/frame_source.hpp"
#include "hw-sim/video/camera_script.hpp"

namespace birdseye::hw_sim {

/// A camera within this process: a CameraScript keeps its time, and its driver meets the faults of the script as it
/// meets them at a frame socket. It is for what happens over time.
class LocalCamera {
 public:
  struct Settings {
    std::string name = "sim:camera";
    CameraTiming timing;
    int width_px = 96, height_px = 72;
    /// RGB, width_px * height_px * 3 bytes, of what is seen at that time. None: pictures are grey all over.
    std::function<std::vector<std::uint8_t>(std::int64_t exposed_ns)> look;
  };
  /// zero_ns: of the first exposure, and of the faults.
  LocalCamera(const Settings& settings, std::int64_t zero_ns);

  /// The driver's end. Errc::not_found while the cable is pulled, Errc::in_use while another has it.
  [[nodiscard]] Result<std::unique_ptr<drivers::FrameSource>> open() const;
  /// The true middle of the exposure of the frame with this number by the camera's own count. Empty: it is too long
  /// ago, or the camera never gave it.
  [[nodiscard]] std::optional<std::int64_t> exposed_ns(std::uint64_t sequence) const;

  struct State;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace birdseye::hw_sim
