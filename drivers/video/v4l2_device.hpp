#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/system/unique_fd.hpp"
#include "drivers/video/camera_offers.hpp"
#include "drivers/video/v4l2_controls.hpp"

namespace birdseye::drivers {

/// The node of a capture device: its ioctls, and what they say of it.
class V4l2Device final : public ControlPort {
 public:
  static Result<V4l2Device> open(const std::string& path);
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] const std::string& card() const { return card_; }
  [[nodiscard]] const std::string& driver() const { return driver_; }
  /// The serial number of the USB device behind the node, as the kernel tells it; empty where there is none.
  [[nodiscard]] std::string usb_serial() const;

  /// ioctl(2), repeated after a signal: 0, or -1 with errno.
  int control(unsigned long request, void* argument) const;
  /// Formats, sizes, and the rates at the size asked for. The lists are bounded, however many the driver offers.
  [[nodiscard]] std::vector<FormatOffer> offers(const CameraSettings& asked) const;
  /// For inputs such as HDMI: sets the device to the signal that comes in and returns the signal's rate. Empty for
  /// other inputs.
  /// Errc::not_found when the cable brings nothing.
  [[nodiscard]] Result<std::optional<double>> follow_signal() const;

  std::optional<Range> range(std::uint32_t id) override;
  std::optional<int> get(std::uint32_t id) override;
  Result<void> set(std::uint32_t id, int value) override;

 private:
  explicit V4l2Device(UniqueFd fd) : fd_(std::move(fd)) {}
  [[nodiscard]] std::vector<SizeOffer> sizes(std::uint32_t fourcc, const CameraSettings& asked) const;
  [[nodiscard]] RateOffer rates(std::uint32_t fourcc, int width_px, int height_px) const;

  UniqueFd fd_;
  std::string card_, driver_;
};

/// Luma, chroma and range as the driver says, or as Video4Linux says of a driver that does not.
YuvColour colour_of(const v4l2_pix_format& format);

}  // namespace birdseye::drivers
