#include "calibration/picture/field_mask.hpp"

#include <opencv2/imgproc.hpp>

namespace birdseye {

cv::Mat field_mask(const cv::Size& size) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  cv::circle(mask, {size.width / 2, size.height / 2}, static_cast<int>(kFieldShare * size.height), 255, cv::FILLED);
  return mask;
}

}  // namespace birdseye
