#pragma once

#include <opencv2/core.hpp>

#include "calibration/base/image_view.hpp"

namespace birdseye::testing {

/// Of a picture of OpenCV's whose rows follow each other without a gap.
inline GreyView view_of(const cv::Mat& grey) {
  return {{grey.data, grey.total()}, grey.cols, grey.rows};
}

}  // namespace birdseye::testing
