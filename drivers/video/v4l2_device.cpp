#include "drivers/video/v4l2_device.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace birdseye::drivers {

namespace {

constexpr std::uint32_t kMostEntries = 128;  // of any list that a driver gives

template <std::size_t N>
std::string text_of(const __u8 (&text)[N]) {
  const auto* begin = reinterpret_cast<const char*>(text);
  return {begin, strnlen(begin, N)};
}

double rate_of(const v4l2_fract& period) {
  return period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
}

Error cannot_open(const std::string& path, int error) {
  switch (error) {
    case EACCES:
    case EPERM:
      return {Errc::unreadable, fmt::format("{}: may not be opened; add this user to the group video", path)};
    case EBUSY:
      return {Errc::in_use, fmt::format("{}: another program has this camera", path)};
    default:
      return {Errc::not_found, fmt::format("{}: no camera can be opened there; see [camera] source", path)};
  }
}

}  // namespace

Result<V4l2Device> V4l2Device::open(const std::string& path) {
  V4l2Device device(UniqueFd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)));
  if (!device.fd_) return cannot_open(path, errno);
  v4l2_capability capability{};
  if (device.control(VIDIOC_QUERYCAP, &capability) != 0) {
    return Error{Errc::unsupported, fmt::format("{}: is no Video4Linux device; see [camera] source", path)};
  }
  const std::uint32_t has =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  const std::uint32_t needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if ((has & needed) != needed) {
    const char* why = (has & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                          ? "gives frames in several pieces, which is not known here"
                          : "does not stream video now";
    return Error{Errc::unsupported, fmt::format("{}: {}; see [camera] source", path, why)};
  }
  device.card_ = text_of(capability.card);
  device.driver_ = text_of(capability.driver);
  return device;
}

std::string V4l2Device::usb_serial() const {
  struct stat node {};
  if (::fstat(fd_.get(), &node) != 0 || !S_ISCHR(node.st_mode)) return {};
  // The node's device is an interface of the USB device, whose folder holds its serial number.
  const auto link = fmt::format("/sys/dev/char/{}:{}/device/../serial", major(node.st_rdev), minor(node.st_rdev));
  std::ifstream file(link);
  std::string serial;
  std::getline(file, serial);
  return serial;
}

int V4l2Device::control(unsigned long request, void* argument) const {
  int result = 0;
  do {
    result = ::ioctl(fd_.get(), request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

std::vector<FormatOffer> V4l2Device::offers(const CameraSettings& asked) const {
  std::vector<FormatOffer> offers;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (control(VIDIOC_ENUM_FMT, &format) != 0) break;
    offers.push_back({format.pixelformat, sizes(format.pixelformat, asked)});
  }
  return offers;
}

std::vector<SizeOffer> V4l2Device::sizes(std::uint32_t fourcc, const CameraSettings& asked) const {
  std::vector<SizeOffer> sizes;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc;
    if (control(VIDIOC_ENUM_FRAMESIZES, &entry) != 0) break;
    SizeOffer size;
    if (entry.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      size.least_width_px = size.most_width_px = static_cast<int>(entry.discrete.width);
      size.least_height_px = size.most_height_px = static_cast<int>(entry.discrete.height);
      size.rates = rates(fourcc, size.least_width_px, size.least_height_px);
      sizes.push_back(size);
      continue;
    }
    const auto& s = entry.stepwise;
    size = {static_cast<int>(s.min_width),
            static_cast<int>(s.max_width),
            static_cast<int>(s.step_width),
            static_cast<int>(s.min_height),
            static_cast<int>(s.max_height),
            static_cast<int>(s.step_height),
            rates(fourcc, asked.width_px, asked.height_px)};
    sizes.push_back(size);
    break;  // a range is the only entry
  }
  return sizes;
}

RateOffer V4l2Device::rates(std::uint32_t fourcc, int width_px, int height_px) const {
  RateOffer offer;
  for (std::uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc;
    entry.width = static_cast<std::uint32_t>(width_px);
    entry.height = static_cast<std::uint32_t>(height_px);
    if (control(VIDIOC_ENUM_FRAMEINTERVALS, &entry) != 0) break;
    if (entry.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      if (const double rate_hz = rate_of(entry.discrete); rate_hz > 0) offer.rates_hz.push_back(rate_hz);
      continue;
    }
    offer.lowest_hz = rate_of(entry.stepwise.max);  // the longest period
    offer.highest_hz = rate_of(entry.stepwise.min);
    break;
  }
  return offer;
}

Result<std::optional<double>> V4l2Device::follow_signal() const {
  v4l2_dv_timings timings{};
  if (control(VIDIOC_QUERY_DV_TIMINGS, &timings) != 0) {
    if (errno == ENOLINK || errno == ENOLCK || errno == ERANGE) {
      return Error{Errc::not_found, "no signal comes in, or none that it understands; see the cable and the source"};
    }
    return std::optional<double>();
  }
  v4l2_dv_timings now{};
  const bool known = control(VIDIOC_G_DV_TIMINGS, &now) == 0 && std::memcmp(&now.bt, &timings.bt, sizeof now.bt) == 0;
  if (!known && control(VIDIOC_S_DV_TIMINGS, &timings) != 0) {
    return Error{errno == EBUSY ? Errc::in_use : Errc::io, "does not take up the signal that comes in"};
  }
  const double pixels = static_cast<double>(V4L2_DV_BT_FRAME_WIDTH(&timings.bt)) * V4L2_DV_BT_FRAME_HEIGHT(&timings.bt);
  if (pixels <= 0 || timings.bt.pixelclock == 0) return std::optional<double>();
  return std::optional<double>(static_cast<double>(timings.bt.pixelclock) / pixels);
}

std::optional<ControlPort::Range> V4l2Device::range(std::uint32_t id) {
  v4l2_queryctrl query{};
  query.id = id;
  if (control(VIDIOC_QUERYCTRL, &query) != 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  return Range{query.minimum, query.maximum};
}

std::optional<int> V4l2Device::get(std::uint32_t id) {
  v4l2_control value{id, 0};
  if (control(VIDIOC_G_CTRL, &value) != 0) return std::nullopt;
  return value.value;
}

Result<void> V4l2Device::set(std::uint32_t id, int value) {
  v4l2_control wanted{id, value};
  if (control(VIDIOC_S_CTRL, &wanted) == 0) return {};
  return Error{Errc::io, fmt::format("the camera refuses it ({})", std::strerror(errno))};  // NOLINT(concurrency-*)
}

YuvColour colour_of(const v4l2_pix_format& format) {
  std::uint32_t encoding = format.ycbcr_enc;
  if (encoding == V4L2_YCBCR_ENC_DEFAULT) encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(format.colorspace);
  std::uint32_t range = format.quantization;
  if (range == V4L2_QUANTIZATION_DEFAULT) range = V4L2_MAP_QUANTIZATION_DEFAULT(false, format.colorspace, encoding);
  YuvColour colour;
  colour.full_range = range == V4L2_QUANTIZATION_FULL_RANGE;
  if (encoding == V4L2_YCBCR_ENC_709 || encoding == V4L2_YCBCR_ENC_XV709) colour.matrix = YuvColour::Matrix::bt709;
  if (encoding == V4L2_YCBCR_ENC_BT2020) colour.matrix = YuvColour::Matrix::bt2020;
  return colour;
}

}  // namespace birdseye::drivers
