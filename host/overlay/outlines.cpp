#include "host/overlay/outlines.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace birdseye::host {

namespace {

// Of 255. What is fainter is a haze that has no outline.
constexpr int kFaintest = 40;
// Of Sobel's gradient of a colour's shares: where an edge goes on, and where it begins (Canny, 1986). Shading leaves
// the shares of red, green and blue as they are.
constexpr double kEdgeGoesOn = 60, kEdgeBegins = 120;
constexpr std::uint8_t kEdgeAlpha = 150;

cv::Mat disc(int radius_px) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius_px + 1, 2 * radius_px + 1});
}

/// The share that a colour has in each pixel, 0 to 255; smoothed, for rounding makes faint ones noisy.
cv::Mat share_of(int channel, const cv::Mat& rgba) {
  cv::Mat share(rgba.size(), CV_8U, cv::Scalar(0));
  for (int y = 0; y < rgba.rows; ++y) {
    for (int x = 0; x < rgba.cols; ++x) {
      const auto& from = rgba.at<cv::Vec4b>(y, x);
      const int sum = from[0] + from[1] + from[2];
      if (sum > 0) share.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(255 * from[channel] / sum);
    }
  }
  cv::medianBlur(share, share, 5);
  return share;
}

/// Where another colour begins, within what is drawn.
cv::Mat colour_edges(const cv::Mat& rgba, const cv::Mat& inside, int width_px) {
  cv::Mat edges(rgba.size(), CV_8U, cv::Scalar(0));
  for (const int channel : {0, 1, 2}) {
    cv::Mat of_channel;
    cv::Canny(share_of(channel, rgba), of_channel, kEdgeGoesOn, kEdgeBegins);
    edges |= of_channel;
  }
  edges &= inside;  // against nothing, the other line is the one
  cv::dilate(edges, edges, cv::getStructuringElement(cv::MORPH_ELLIPSE, {width_px, width_px}));
  return edges & inside;
}

/// As bright as its colour can be.
cv::Vec4b without_shading(const cv::Vec4b& rgba) {
  const int most = std::max({rgba[0], rgba[1], rgba[2], std::uint8_t{1}});
  const auto bright = [most](int value) { return static_cast<std::uint8_t>(255 * value / most); };
  return {bright(rgba[0]), bright(rgba[1]), bright(rgba[2]), 255};
}

}  // namespace

ImageRgba outlines_of(const ImageRgba& drawn) {
  ImageRgba out{drawn.width_px, drawn.height_px, std::vector<std::uint8_t>(drawn.rgba.size())};
  if (drawn.rgba.empty()) return out;
  ImageRgba copy = drawn;  // OpenCV takes no constant pixels
  const cv::Mat rgba(drawn.height_px, drawn.width_px, CV_8UC4, copy.rgba.data());
  cv::Mat to(drawn.height_px, drawn.width_px, CV_8UC4, out.rgba.data());
  const int width_px = std::max(1, drawn.height_px / 220);
  cv::Mat mask, inside, around;
  cv::extractChannel(rgba, mask, 3);
  cv::threshold(mask, mask, kFaintest, 255, cv::THRESH_BINARY);
  // What the picture's border cuts off goes on beyond it.
  cv::erode(mask, inside, disc(width_px), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const cv::Mat lines = (mask & ~inside) | colour_edges(rgba, inside, width_px);
  cv::dilate(lines, around, disc(std::max(1, width_px / 2)));
  for (int y = 0; y < rgba.rows; ++y) {
    for (int x = 0; x < rgba.cols; ++x) {
      if (lines.at<std::uint8_t>(y, x) != 0) {
        to.at<cv::Vec4b>(y, x) = without_shading(rgba.at<cv::Vec4b>(y, x));
      } else if (around.at<std::uint8_t>(y, x) != 0) {
        to.at<cv::Vec4b>(y, x)[3] = kEdgeAlpha;
      }
    }
  }
  return out;
}

}  // namespace birdseye::host
