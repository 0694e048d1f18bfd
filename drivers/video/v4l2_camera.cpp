#include "drivers/video/v4l2_camera.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "drivers/video/jpeg_decoder.hpp"

namespace birdseye::drivers {

namespace {

constexpr unsigned kBuffers = 4;
/// After a buffer that the driver could not give although it said there was one.
constexpr Duration kBreath = Duration::from_ms(5);

v4l2_buffer mapped_buffer(unsigned index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

PixelLayout layout_of(const v4l2_pix_format& pix, PixelFormat format) {
  PixelLayout layout = packed_layout(format, static_cast<int>(pix.width), static_cast<int>(pix.height));
  layout.colour = colour_of(pix);
  if (format == PixelFormat::mjpeg) return layout;
  layout.stride = std::max<std::size_t>(layout.stride, pix.bytesperline);
  if (format == PixelFormat::nv12) {  // in one buffer both planes have the same stride
    layout.chroma_offset = layout.stride * pix.height;
    layout.chroma_stride = std::max(layout.chroma_stride, layout.stride);
  }
  return layout;
}

std::string text_of(const YuvColour& colour) {
  const char* matrix = colour.matrix == YuvColour::Matrix::bt601   ? "601"
                       : colour.matrix == YuvColour::Matrix::bt709 ? "709"
                                                                   : "2020";
  return fmt::format("BT.{} {} range", matrix, colour.full_range ? "full" : "limited");
}

}  // namespace

Result<std::unique_ptr<FrameSource>> V4l2Camera::open(const std::filesystem::path& path,
                                                      const CameraSettings& settings) {
  auto device = V4l2Device::open(path.string());
  if (!device) return device.error();
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(*std::move(device), path.string()));
  if (auto ready = camera->set_up(settings); !ready) return ready.error();
  return std::unique_ptr<FrameSource>(std::move(camera));
}

Result<void> V4l2Camera::set_up(const CameraSettings& settings) {
  const auto signal_hz = device_.follow_signal();
  if (!signal_hz) return signal_hz.error().with_context(name_);
  const auto plan = choose(device_.offers(settings), settings);
  if (!plan) return plan.error().with_context(name_);
  if (auto set = set_format(*plan); !set) return set;
  set_rate(*plan, *signal_hz);
  report_ = controls_.apply(settings);
  stamps_.exposure = controls_.exposure();
  stamps_.readout = settings.readout;
  if (auto mapped = map_buffers(); !mapped) return mapped;
  return start_streaming();
}

Result<void> V4l2Camera::set_format(const CameraPlan& plan) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(plan.width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(plan.height_px);
  format.fmt.pix.pixelformat = plan.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.priv = V4L2_PIX_FMT_PRIV_MAGIC;  // so that colours and their range are told
  if (device_.control(VIDIOC_S_FMT, &format) != 0) return failed("setting the format");
  const v4l2_pix_format& pix = format.fmt.pix;
  if (pix.pixelformat != plan.fourcc || pix.width != static_cast<std::uint32_t>(plan.width_px) ||
      pix.height != static_cast<std::uint32_t>(plan.height_px)) {
    return Error{Errc::unsupported,
                 fmt::format("{}: gives {} {}x{} when asked for {} {}x{}; set [camera] width and height", name_,
                             fourcc_name(pix.pixelformat), pix.width, pix.height, fourcc_name(plan.fourcc),
                             plan.width_px, plan.height_px)};
  }
  layout_ = layout_of(pix, plan.format);
  return {};
}

/// After the format, which sets the rate back. What the driver then says is what it does.
void V4l2Camera::set_rate(const CameraPlan& plan, std::optional<double> signal_hz) {
  asked_hz_ = plan.rate_hz;
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(plan.rate_hz * 1000))};
  const bool said = device_.control(VIDIOC_S_PARM, &rate) == 0 || device_.control(VIDIOC_G_PARM, &rate) == 0;
  const v4l2_fract period = rate.parm.capture.timeperframe;
  if (signal_hz) {
    rate_hz_ = *signal_hz;
  } else if (said && period.numerator != 0 && period.denominator != 0) {
    rate_hz_ = static_cast<double>(period.denominator) / period.numerator;
  }
  stamps_.period = Duration::from_seconds(1 / (rate_hz_ > 0 ? rate_hz_ : asked_hz_));
}

Result<void> V4l2Camera::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (device_.control(VIDIOC_REQBUFS, &request) != 0 || request.count < 2) return failed("asking for buffers");
  for (unsigned i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (device_.control(VIDIOC_QUERYBUF, &buffer) != 0) return failed("asking for a buffer");
    void* start = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_.fd(), buffer.m.offset);
    if (start == MAP_FAILED) return failed("mapping a buffer");
    v4l2_exportbuffer exported{};
    exported.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    exported.index = i;
    exported.flags = O_RDONLY | O_CLOEXEC;
    const bool has = device_.control(VIDIOC_EXPBUF, &exported) == 0;
    buffers_.push_back({start, buffer.length, UniqueFd(has ? exported.fd : -1)});
  }
  return {};
}

Result<void> V4l2Camera::start_streaming() {
  for (unsigned i = 0; i < buffers_.size(); ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (device_.control(VIDIOC_QBUF, &buffer) != 0) return failed("queueing a buffer");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device_.control(VIDIOC_STREAMON, &type) != 0) return failed("starting the stream");
  sequence_.restart();
  return {};
}

Result<void> V4l2Camera::restart_stream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device_.control(VIDIOC_STREAMOFF, &type) != 0) return failed("stopping the stream");
  return start_streaming();
}

V4l2Camera::~V4l2Camera() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)device_.control(VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) ::munmap(buffer.start, buffer.length);
}

Error V4l2Camera::gone() const {
  return {Errc::disconnected, fmt::format("{}: the camera has gone; was it unplugged?", name_)};
}

Error V4l2Camera::failed(const std::string& what) const {
  if (errno == ENODEV) return gone();
  if (errno == EBUSY) {
    return {Errc::in_use, fmt::format("{}: {} failed: another program is using it", name_, what)};
  }
  return {Errc::io, fmt::format("{}: {} failed ({})", name_, what, fmt::system_error(errno, "").what())};
}

ControlReport V4l2Camera::lock_controls() {
  auto report = controls_.lock();
  stamps_.exposure = controls_.exposure();
  return report;
}

ControlReport V4l2Camera::unlock_controls() {
  auto report = controls_.unlock();
  stamps_.exposure = controls_.exposure();
  return report;
}

Result<std::optional<Frame>> V4l2Camera::next(Deadline deadline) {
  for (;;) {
    if (const short ready = wait_ready(device_.fd(), POLLIN, deadline); ready != 0) {
      auto frame = take();
      if (!frame || *frame) return frame;
      // A driver in trouble says at once, and again and again, that there is something.
      if ((ready & POLLERR) != 0) sleep_for(std::min(kBreath, deadline.left()));
    }
    if (deadline.passed()) return std::optional<Frame>();
  }
}

/// Empty: no whole frame this time.
Result<std::optional<Frame>> V4l2Camera::take() {
  v4l2_buffer buffer = mapped_buffer(0);
  if (device_.control(VIDIOC_DQBUF, &buffer) != 0) {
    if (errno == EAGAIN) return std::optional<Frame>();
    if (errno != EIO) return gone();
    ++counters_.incomplete;  // the signal failed for a moment
    sleep_for(kBreath);
    return std::optional<Frame>();
  }
  Frame frame;
  frame.arrived = device_now();
  frame.width_px = layout_.width_px;
  frame.height_px = layout_.height_px;
  const auto step = sequence_.push(buffer.sequence);
  frame.sequence = step.sequence;
  counters_.gaps += step.lost;
  stamp(frame, buffer);
  frame.rgb = pixels_of(buffer);
  if (device_.control(VIDIOC_QBUF, &buffer) != 0) return gone();
  ++(frame.rgb ? counters_.frames : counters_.incomplete);
  if (!frame.rgb) return std::optional<Frame>();
  return std::optional<Frame>(std::move(frame));
}

void V4l2Camera::stamp(Frame& frame, const v4l2_buffer& buffer) {
  const DeviceTime at{buffer.timestamp.tv_sec * std::int64_t{1'000'000'000} +
                      buffer.timestamp.tv_usec * std::int64_t{1'000}};
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!monotonic || at.ns <= 0) {
    stamp_kind_ = StampKind::none;
    return;
  }
  stamps_.start_of_exposure = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  stamp_kind_ = stamps_.start_of_exposure ? StampKind::start_of_exposure : StampKind::end_of_frame;
  const MidExposure middle = mid_exposure(at, stamps_);
  frame.acquired = middle.at;
  frame.acquired_sigma = middle.sigma;
  frame.acquired_known = true;
  frame.stamp_ahead = std::max(at - frame.arrived, Duration{});
}

/// Null when the frame is not whole.
std::shared_ptr<const PixelPool::Pixels> V4l2Camera::pixels_of(const v4l2_buffer& buffer) {
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.index >= buffers_.size()) return nullptr;
  const Buffer& memory = buffers_[buffer.index];
  const std::span bytes(static_cast<const std::uint8_t*>(memory.start),
                        std::min<std::size_t>(buffer.bytesused, memory.length));
  if (bytes.empty() || bytes.size() < bytes_needed(layout_)) return nullptr;
  auto pixels = pool_.take();
  if (layout_.format != PixelFormat::mjpeg) {
    to_rgb(bytes, layout_, *pixels);
  } else if (!decode_jpeg(bytes, layout_.width_px, layout_.height_px, *pixels)) {
    pool_.give_back(std::move(pixels));
    return nullptr;
  }
  return pool_.share(std::move(pixels));
}

std::map<std::string, std::string> V4l2Camera::identity() const {
  std::map<std::string, std::string> identity{{"model", device_.card()}};
  if (const std::string serial = device_.usb_serial(); !serial.empty()) identity["serial"] = serial;
  return identity;
}

std::string V4l2Camera::describe() const {
  std::string format = fourcc_name(fourcc_of(layout_.format));
  const bool yuv =
      layout_.format == PixelFormat::yuyv || layout_.format == PixelFormat::uyvy || layout_.format == PixelFormat::nv12;
  if (yuv) format += fmt::format(" ({})", text_of(layout_.colour));
  std::string rate = rate_hz_ > 0 ? fmt::format("{:.4g} Hz", rate_hz_) : "a rate it does not say";
  if (rate_hz_ > 0 && std::abs(rate_hz_ - asked_hz_) > 0.005 * asked_hz_)
    rate += fmt::format(" (asked {:.4g})", asked_hz_);
  const char* stamps = stamp_kind_ == StampKind::unseen              ? "not seen yet"
                       : stamp_kind_ == StampKind::none              ? "none that can be used"
                       : stamp_kind_ == StampKind::start_of_exposure ? "start of exposure"
                                                                     : "end of frame";
  const bool exported = !buffers_.empty() && buffers_.front().dmabuf;
  return fmt::format("{}: {} ({}), {} {}x{} at {}, stamps: {}, {} buffers{}", name_, device_.card(), device_.driver(),
                     format, layout_.width_px, layout_.height_px, rate, stamps, buffers_.size(),
                     exported ? " exported as DMABUF" : "");
}

}  // namespace birdseye::drivers
