#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/video/frame_source.hpp"
#include "drivers/video/pixel_format.hpp"

namespace birdseye::drivers {

/// Rates at one size: single ones, or a range (whose steps are too fine to matter). Neither: the camera does not say.
struct RateOffer {
  std::vector<double> rates_hz;
  double lowest_hz = 0, highest_hz = 0;
};

/// One size (least = most), or all sizes of a range by steps.
struct SizeOffer {
  int least_width_px = 0, most_width_px = 0, step_width_px = 1;
  int least_height_px = 0, most_height_px = 0, step_height_px = 1;
  RateOffer rates;  ///< of a range: at the size that was asked for
};

struct FormatOffer {
  std::uint32_t fourcc = 0;
  std::vector<SizeOffer> sizes;  ///< none: the camera does not say
};

/// What to ask a camera for.
struct CameraPlan {
  PixelFormat format = PixelFormat::rgb8;
  std::uint32_t fourcc = 0;
  int width_px = 0, height_px = 0;
  double rate_hz = 0;  ///< one of those offered, where it says
};

/// The cheapest format that has the size at the rate; else an error of one line that says what there is instead: other
/// rates at this size, or other sizes, or formats. A rate is met by one within half a percent: 60 is 59.94.
Result<CameraPlan> choose(const std::vector<FormatOffer>& offers, const CameraSettings& asked);

}  // namespace birdseye::drivers
