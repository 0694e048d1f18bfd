#include "host/report/even_colours.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace birdseye::host {

namespace {

constexpr int kSteps = 256;

std::array<Colour, kSteps> viridis() {
  cv::Mat steps(1, kSteps, CV_8U), colours;
  for (int i = 0; i < kSteps; ++i) steps.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(steps, colours, cv::COLORMAP_VIRIDIS);
  std::array<Colour, kSteps> out{};
  for (int i = 0; i < kSteps; ++i) {
    const auto& bgr = colours.at<cv::Vec3b>(0, i);
    out[static_cast<std::size_t>(i)] = {bgr[2], bgr[1], bgr[0]};
  }
  return out;
}

}  // namespace

Colour even_colour(double share) {
  if (!std::isfinite(share)) return {128, 128, 128};
  static const std::array<Colour, kSteps> kColours = viridis();
  return kColours[static_cast<std::size_t>(std::lround((kSteps - 1) * std::clamp(share, 0.0, 1.0)))];
}

}  // namespace birdseye::host
