#pragma once

#include <opencv2/core.hpp>

#include "calibration/base/image_view.hpp"

namespace birdseye {

/// The picture's own pixels for OpenCV to read. It has no view of what must not be written: whoever takes one reads.
cv::Mat mat_of(const GreyView& picture);
cv::Mat mat_of(const RgbView& picture);
cv::Mat mat_of(const RgbaView& picture);

}  // namespace birdseye
