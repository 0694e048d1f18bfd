#include "drivers/video/v4l2_camera.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <cerrno>

#include "drivers/io/monotonic.hpp"

namespace birdseye::drivers {

namespace {

constexpr unsigned kBuffers = 4;

int retrying_ioctl(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> V4l2Camera::open(const std::filesystem::path& device,
                                                      const CameraSettings& settings) {
  const std::string name = device.string();
  UniqueFd fd(::open(name.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd) {
    return Error{errno == EACCES ? Errc::unreadable : Errc::not_found,
                 fmt::format("{}: no camera can be opened there; see [camera] source and the group video", name),
                 errno};
  }
  v4l2_capability capability{};
  const unsigned needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if (retrying_ioctl(fd.get(), VIDIOC_QUERYCAP, &capability) != 0 || (capability.device_caps & needed) != needed) {
    return Error{Errc::unsupported,
                 fmt::format("{}: is not a streaming video capture device; see [camera] source", name), errno};
  }
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(std::move(fd), name));
  if (auto set = camera->set_format(settings); !set) return set.error();
  if (auto started = camera->start_streaming(); !started) return started.error();
  return std::unique_ptr<FrameSource>(std::move(camera));
}

Result<void> V4l2Camera::set_format(const CameraSettings& settings) {
  for (const std::uint32_t fourcc : {V4L2_PIX_FMT_RGB24, V4L2_PIX_FMT_BGR24, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY}) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<std::uint32_t>(settings.width_px);
    format.fmt.pix.height = static_cast<std::uint32_t>(settings.height_px);
    format.fmt.pix.pixelformat = fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (retrying_ioctl(fd_.get(), VIDIOC_S_FMT, &format) != 0 || format.fmt.pix.pixelformat != fourcc) continue;
    width_px_ = static_cast<int>(format.fmt.pix.width);
    height_px_ = static_cast<int>(format.fmt.pix.height);
    if (width_px_ != settings.width_px || height_px_ != settings.height_px) {
      return Error{Errc::unsupported, fmt::format("{}: gives {}x{}, not {}x{}; set [camera] width and height", name_,
                                                  width_px_, height_px_, settings.width_px, settings.height_px)};
    }
    format_ = *pixel_format_of_fourcc(fourcc);
    stride_ = format.fmt.pix.bytesperline;
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(settings.rate_hz * 1000)};
    (void)retrying_ioctl(fd_.get(), VIDIOC_S_PARM, &rate);  // some cameras have one rate and no such control
    period_ = Duration::from_seconds(1 / settings.rate_hz);
    return {};
  }
  return Error{Errc::unsupported, fmt::format("{}: gives none of RGB24, BGR24, YUYV, GREY", name_)};
}

Result<void> V4l2Camera::start_streaming() {
  const auto failed = [this](const char* what) {
    return Error{Errc::io, fmt::format("{}: {} failed; is another program using it?", name_, what), errno};
  };
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (retrying_ioctl(fd_.get(), VIDIOC_REQBUFS, &request) != 0 || request.count < 2)
    return failed("asking for buffers");
  for (unsigned i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (retrying_ioctl(fd_.get(), VIDIOC_QUERYBUF, &buffer) != 0) return failed("asking for a buffer");
    void* start = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), buffer.m.offset);
    if (start == MAP_FAILED) return failed("mapping a buffer");
    buffers_.push_back({start, buffer.length});
    if (retrying_ioctl(fd_.get(), VIDIOC_QBUF, &buffer) != 0) return failed("queueing a buffer");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (retrying_ioctl(fd_.get(), VIDIOC_STREAMON, &type) != 0) return failed("starting the stream");
  return {};
}

V4l2Camera::~V4l2Camera() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)retrying_ioctl(fd_.get(), VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) ::munmap(buffer.start, buffer.length);
}

Result<std::optional<Frame>> V4l2Camera::next(DeviceTime deadline) {
  for (;;) {
    pollfd entry{fd_.get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, poll_ms(deadline));
    if (ready == 0 && now() >= deadline) return std::optional<Frame>();
    if (ready <= 0) continue;
    auto frame = take();
    if (frame) return std::optional<Frame>(*std::move(frame));
    if (frame.error().os_errno != EAGAIN) return frame.error();
  }
}

Result<Frame> V4l2Camera::take() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (retrying_ioctl(fd_.get(), VIDIOC_DQBUF, &buffer) != 0) {
    return Error{Errc::disconnected, fmt::format("{}: the camera has gone; was it unplugged?", name_), errno};
  }
  Frame frame;
  frame.arrived = now();
  frame.width_px = width_px_;
  frame.height_px = height_px_;
  frame.sequence = buffer.sequence;
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  const DeviceTime stamp = monotonic ? DeviceTime{buffer.timestamp.tv_sec * std::int64_t{1'000'000'000} +
                                                  buffer.timestamp.tv_usec * std::int64_t{1'000}}
                                     : frame.arrived;
  frame.acquired = at_start ? stamp : stamp - Duration{period_.ns / 2};
  frame.acquired_sigma = {at_start && monotonic ? period_.ns / 10 : period_.ns / 2};
  frame.acquired_known = true;
  const Buffer& memory = buffers_[buffer.index];
  const std::size_t expected = stride_ * static_cast<std::size_t>(height_px_);
  const bool whole = buffer.bytesused >= expected && (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0;
  if (whole) {
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(
        to_rgb({static_cast<const std::uint8_t*>(memory.start), expected}, format_, width_px_, height_px_, stride_));
  }
  if (retrying_ioctl(fd_.get(), VIDIOC_QBUF, &buffer) != 0) {
    return Error{Errc::disconnected, fmt::format("{}: the camera has gone; was it unplugged?", name_), errno};
  }
  if (!whole) return Error{Errc::io, fmt::format("{}: a frame came incomplete", name_), EAGAIN};
  return frame;
}

}  // namespace birdseye::drivers
