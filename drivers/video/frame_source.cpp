#include "drivers/video/frame_source.hpp"

#include <fmt/format.h>

#include "drivers/video/pixel_format.hpp"
#include "drivers/video/socket_camera.hpp"
#include "drivers/video/v4l2_camera.hpp"

namespace birdseye::drivers {

Result<void> check_camera(const CameraSettings& settings) {
  const std::string& source = settings.source;
  const auto names = [&](const std::string& kind) { return source.starts_with(kind) && source.size() > kind.size(); };
  if (!names("v4l2:") && !names("socket:"))
    return Error{Errc::bad_value, fmt::format("source \"{}\": give v4l2:DEVICE or socket:PATH", source)};
  if (!settings.format.empty() && !pixel_format_of_name(settings.format)) {
    return Error{Errc::bad_value,
                 fmt::format("format \"{}\": none that is read here; see docs/manual/cameras.md", settings.format)};
  }
  return {};
}

Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings) {
  if (auto sound = check_camera(settings); !sound) return sound.error();
  const std::string& source = settings.source;
  if (source.starts_with("v4l2:")) return V4l2Camera::open(source.substr(5), settings);
  return SocketCamera::open(source.substr(7));
}

}  // namespace birdseye::drivers
