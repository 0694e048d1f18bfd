#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/video/frame_sink.hpp"

namespace birdseye::hw_sim {

namespace {

int control(int fd, unsigned long request, void* argument) {
  int done = -1;
  do {
    done = ::ioctl(fd, request, argument);
  } while (done != 0 && errno == EINTR);
  return done;
}

std::uint32_t pixel_format_of(FrameFormat frame_format) {
  const std::string_view name = fourcc_of(frame_format);
  return v4l2_fourcc(name[0], name[1], name[2], name[3]);
}

class VideoOutput final : public FrameSink {
 public:
  VideoOutput(std::filesystem::path device, FrameFormat frame_format, int width_px, int height_px, double rate_hz,
              std::uint64_t seed)
      : device_(std::move(device)),
        format_(frame_format),
        width_px_(width_px),
        height_px_(height_px),
        rate_hz_(rate_hz),
        seed_(seed) {}

  Result<void> open(int width_px, int height_px) {
    now_width_px_ = 0;
    fd_ = UniqueFd(::open(device_.c_str(), O_RDWR | O_CLOEXEC));
    if (!fd_) {
      return Error{Errc::unreadable, fmt::format("{}: cannot be opened: {}", device_.string(), std::strerror(errno))};
    }
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = static_cast<std::uint32_t>(width_px);
    format.fmt.pix.height = static_cast<std::uint32_t>(height_px);
    format.fmt.pix.pixelformat = pixel_format_of(format_);
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.sizeimage = static_cast<std::uint32_t>(frame_bytes(format_, width_px, height_px));
    if (control(fd_.get(), VIDIOC_S_FMT, &format) != 0 ||
        format.fmt.pix.width != static_cast<std::uint32_t>(width_px) ||
        format.fmt.pix.height != static_cast<std::uint32_t>(height_px) ||
        format.fmt.pix.pixelformat != pixel_format_of(format_)) {
      return Error{Errc::unsupported, fmt::format("{}: takes no {} of {}x{}; is it an output node (v4l2loopback), and "
                                                  "has no reader fixed another format?",
                                                  device_.string(), fourcc_of(format_), width_px, height_px)};
    }
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    rate.parm.output.timeperframe = {1000, static_cast<std::uint32_t>(1000 * rate_hz_)};
    control(fd_.get(), VIDIOC_S_PARM, &rate);  // says what readers are told; not all nodes take it
    now_width_px_ = width_px;
    return {};
  }

  [[nodiscard]] bool connected() const override { return static_cast<bool>(fd_); }
  [[nodiscard]] bool busy() const override { return false; }

  void begin(const FramePlan& plan, const FramePixels& picture) override {
    if (!fd_ || (picture.width_px != now_width_px_ && !open(picture.width_px, picture.height_px))) return;
    auto bytes = picture.pixels;
    if (plan.garbage_bytes > 0) {
      // A node has no place for bytes between frames: the picture itself is noise.
      noise_.resize(bytes.size());
      for (std::size_t i = 0; i < noise_.size(); ++i) {
        noise_[i] = static_cast<std::uint8_t>(hashed_word(seed_ + 124, plan.number + i) & 0xFFU);
      }
      bytes = noise_;
    }
    bytes = bytes.first(static_cast<std::size_t>(plan.part * static_cast<double>(bytes.size())));
    for (int copy = 0; copy < plan.copies; ++copy) {
      while (::write(fd_.get(), bytes.data(), bytes.size()) < 0 && errno == EINTR) {
      }
    }
  }
  void work(std::int64_t until_ns) override { sleep_until(DeviceTime{until_ns}); }
  void unplug() override { fd_ = UniqueFd(); }
  Result<void> replug() override { return open(width_px_, height_px_); }

 private:
  std::filesystem::path device_;
  FrameFormat format_;
  int width_px_, height_px_;
  double rate_hz_;
  std::uint64_t seed_;
  UniqueFd fd_;
  int now_width_px_ = 0;
  std::vector<std::uint8_t> noise_;
};

}  // namespace

Result<std::unique_ptr<FrameSink>> open_video_output(const std::filesystem::path& device, FrameFormat frame_format,
                                                     int width_px, int height_px, double rate_hz, std::uint64_t seed) {
  auto output = std::make_unique<VideoOutput>(device, frame_format, width_px, height_px, rate_hz, seed);
  if (const auto opened = output->open(width_px, height_px); !opened) return opened.error();
  return std::unique_ptr<FrameSink>(std::move(output));
}

}  // namespace birdseye::hw_sim
