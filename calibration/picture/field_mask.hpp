#pragma once

#include <opencv2/core.hpp>

namespace birdseye {

/// Inside the round field of any laparoscope: the radius of a circle about the picture's middle, of the picture's
/// height.
inline constexpr double kFieldShare = 0.42;

/// White within that circle, black around it.
cv::Mat field_mask(const cv::Size& size);

}  // namespace birdseye
