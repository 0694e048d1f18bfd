#include "drivers/video/frame_source.hpp"

#include <fmt/format.h>

#include "drivers/video/pixel_format.hpp"
#include "drivers/video/socket_camera.hpp"
#include "drivers/video/v4l2_camera.hpp"

namespace birdseye::drivers {

std::vector<std::string> faults_of(const CameraSettings& settings) {
  std::vector<std::string> faults;
  const std::string& source = settings.source;
  const auto names = [&](const std::string& kind) { return source.starts_with(kind) && source.size() > kind.size(); };
  if (!names("v4l2:") && !names("socket:"))
    faults.push_back(fmt::format("source: \"{}\": give v4l2:DEVICE or socket:PATH", source));
  if (!settings.format.empty() && !pixel_format_of_name(settings.format)) {
    faults.push_back(
        fmt::format("format: \"{}\": none that is read here; see docs/manual/cameras.md", settings.format));
  }
  return faults;
}

Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings) {
  if (const auto faults = faults_of(settings); !faults.empty()) return Error{Errc::bad_value, faults.front()};
  const std::string& source = settings.source;
  if (source.starts_with("v4l2:")) return V4l2Camera::open(source.substr(5), settings);
  return SocketCamera::open(source.substr(7));
}

}  // namespace birdseye::drivers
