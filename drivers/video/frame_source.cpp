#include "drivers/video/frame_source.hpp"

#include <fmt/format.h>

#include "drivers/video/socket_camera.hpp"
#include "drivers/video/v4l2_camera.hpp"

namespace birdseye::drivers {

Result<std::unique_ptr<FrameSource>> open_camera(const CameraSettings& settings) {
  const std::string& source = settings.source;
  if (source.starts_with("v4l2:")) return V4l2Camera::open(source.substr(5), settings);
  if (source.starts_with("socket:")) return SocketCamera::open(source.substr(7));
  return Error{Errc::bad_value, fmt::format("[camera] source \"{}\": give v4l2:DEVICE or socket:PATH", source)};
}

}  // namespace birdseye::drivers
