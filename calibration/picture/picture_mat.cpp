#include "calibration/picture/picture_mat.hpp"

namespace birdseye {

namespace {

template <std::size_t channels>
cv::Mat shared(const ImageView<channels>& picture) {
  return {picture.height_px, picture.width_px, CV_8UC(static_cast<int>(channels)),
          const_cast<std::uint8_t*>(picture.pixels.data())};
}

}  // namespace

cv::Mat mat_of(const GreyView& picture) {
  return shared(picture);
}

cv::Mat mat_of(const RgbView& picture) {
  return shared(picture);
}

cv::Mat mat_of(const RgbaView& picture) {
  return shared(picture);
}

}  // namespace birdseye
