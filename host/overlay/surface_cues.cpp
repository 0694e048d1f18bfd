#include "host/overlay/surface_cues.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "calibration/picture/picture_mat.hpp"

namespace birdseye::host {

namespace {

// Grey levels of contrast nearby: what noise and the lamp's fall have, and how steeply what is above counts.
constexpr int kNoise = 6, kGain = 7, kMostCue = 170;
constexpr int kHighlight = 225, kOfHighlight = 210;

}  // namespace

std::vector<std::uint8_t> surface_cues(const RgbView& video) {
  if (!video.whole()) return {};
  std::vector<std::uint8_t> out(video.area_px());
  const cv::Mat rgb = mat_of(video);
  cv::Mat grey, fine, low, high;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  cv::boxFilter(grey, fine, -1, {3, 3});
  // The steps from the darkest to the brightest nearby: at an edge they are the largest.
  const int reach = std::max(3, video.height_px / 115) | 1;
  const cv::Mat nearby = cv::getStructuringElement(cv::MORPH_RECT, {reach, reach});
  cv::erode(fine, low, nearby);
  cv::dilate(fine, high, nearby);
  std::array<std::uint8_t, 256> of_contrast{};
  for (int contrast = 0; contrast < 256; ++contrast)
    of_contrast[static_cast<std::size_t>(contrast)] =
        static_cast<std::uint8_t>(std::clamp((contrast - kNoise) * kGain, 0, kMostCue));
  for (int y = 0; y < video.height_px; ++y) {
    const auto* const here = fine.ptr<std::uint8_t>(y);
    const auto* const darkest = low.ptr<std::uint8_t>(y);
    const auto* const brightest = high.ptr<std::uint8_t>(y);
    std::uint8_t* const to = &out[static_cast<std::size_t>(y) * static_cast<std::size_t>(video.width_px)];
    for (int x = 0; x < video.width_px; ++x) {
      const auto contrast = static_cast<std::size_t>(brightest[x] - darkest[x]);
      to[x] = here[x] >= kHighlight ? std::uint8_t{kOfHighlight} : of_contrast[contrast];
    }
  }
  return out;
}

}  // namespace birdseye::host
