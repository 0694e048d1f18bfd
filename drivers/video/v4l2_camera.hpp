#pragma once

#include <filesystem>
#include <span>

#include "drivers/video/frame_source.hpp"
#include "drivers/video/frame_stamp.hpp"
#include "drivers/video/pixel_format.hpp"
#include "drivers/video/pixel_pool.hpp"
#include "drivers/video/v4l2_device.hpp"

namespace birdseye::drivers {

/// A Video4Linux2 capture device, streaming into memory-mapped buffers. One thread uses it. A frame's time is the
/// driver's stamp where that is one of CLOCK_MONOTONIC, moved to the middle of the exposure as far as the exposure is
/// known.
class V4l2Camera final : public FrameSource {
 public:
  static Result<std::unique_ptr<FrameSource>> open(const std::filesystem::path& path, const CameraSettings& settings);
  ~V4l2Camera() override;

  Result<std::optional<Frame>> next(Deadline deadline) override;
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] std::map<std::string, std::string> identity() const override;
  [[nodiscard]] FrameCounters counters() const override { return counters_; }
  [[nodiscard]] double rate_hz() const override { return rate_hz_; }
  [[nodiscard]] std::optional<Duration> exposure() const override { return stamps_.exposure; }
  [[nodiscard]] ControlReport controls() const override { return report_; }
  ControlReport lock_controls() override;
  ControlReport unlock_controls() override;
  Result<void> restart_stream() override;

 private:
  struct Buffer {
    void* start = nullptr;
    std::size_t length = 0;
    UniqueFd dmabuf;  // for a reader that takes the pixels without a copy; empty where the driver has none
  };
  enum class StampKind { unseen, none, start_of_exposure, end_of_frame };

  V4l2Camera(V4l2Device device, std::string name) : device_(std::move(device)), name_(std::move(name)) {}
  Result<void> set_up(const CameraSettings& settings);
  Result<void> set_format(const CameraPlan& plan);
  void set_rate(const CameraPlan& plan, std::optional<double> signal_hz);
  Result<void> map_buffers();
  Result<void> start_streaming();
  Result<std::optional<Frame>> take();
  void stamp(Frame& frame, const v4l2_buffer& buffer);
  std::shared_ptr<const PixelPool::Pixels> pixels_of(const v4l2_buffer& buffer);
  [[nodiscard]] Error gone() const;
  [[nodiscard]] Error failed(const std::string& what) const;

  V4l2Device device_;
  std::string name_;
  V4l2Controls controls_{device_};
  ControlReport report_;
  std::vector<Buffer> buffers_;
  PixelLayout layout_;
  PixelPool pool_;
  double asked_hz_ = 0, rate_hz_ = 0;
  StampMeaning stamps_;
  StampKind stamp_kind_ = StampKind::unseen;
  SequenceLine sequence_;
  FrameCounters counters_;
};

}  // namespace birdseye::drivers
