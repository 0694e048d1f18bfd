#pragma once

#include <filesystem>

#include "drivers/io/unique_fd.hpp"
#include "drivers/video/frame_source.hpp"
#include "drivers/video/pixel_format.hpp"

namespace birdseye::drivers {

/// A Video4Linux2 capture device, streaming into memory-mapped buffers. Takes RGB, BGR, YUYV or grey, in that order of
/// liking. A frame's time is the driver's stamp (CLOCK_MONOTONIC); where that marks the end of the frame rather than
/// the start of its exposure, half a frame period is taken off, and the sigma says that it was.
class V4l2Camera final : public FrameSource {
 public:
  static Result<std::unique_ptr<FrameSource>> open(const std::filesystem::path& device, const CameraSettings& settings);
  ~V4l2Camera() override;
  Result<std::optional<Frame>> next(DeviceTime deadline) override;
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string describe() const override { return name_; }
  [[nodiscard]] FrameCounters counters() const override { return counters_; }

 private:
  struct Buffer {
    void* start = nullptr;
    std::size_t length = 0;
  };
  V4l2Camera(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  Result<void> set_format(const CameraSettings& settings);
  Result<void> start_streaming();
  Result<Frame> take();

  UniqueFd fd_;
  std::string name_;
  FrameCounters counters_;
  std::vector<Buffer> buffers_;
  PixelFormat format_ = PixelFormat::rgb8;
  int width_px_ = 0, height_px_ = 0;
  std::size_t stride_ = 0;
  Duration period_;
};

}  // namespace birdseye::drivers
