#include "host/window/stall_picture.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

/// OpenCV's font has the letters of ASCII alone: words with others stay English.
std::string drawable(TextKey<0> text) {
  const std::string& said = words(text);
  const bool ascii = std::all_of(said.begin(), said.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return ascii ? said : std::string(kEnglish[text.index].english);
}

}  // namespace

Picture stall_picture(float scale) {
  Picture out;
  out.width_px = static_cast<int>(560 * scale);
  out.height_px = static_cast<int>(200 * scale);
  out.rgb.resize(std::size_t{3} * static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px));
  cv::Mat rgb(out.height_px, out.width_px, CV_8UC3, out.rgb.data());
  rgb = cv::Scalar(44, 12, 12);
  const auto say = [&](const std::string& text, double height, int thick, double y) {
    cv::putText(rgb, text, cv::Point(static_cast<int>(30 * scale), static_cast<int>(y * scale)),
                cv::FONT_HERSHEY_DUPLEX, height * scale, cv::Scalar(245, 97, 87), thick, cv::LINE_AA);
  };
  say(drawable("stall_not_live"), 1.6, 3, 90);
  say(drawable("stall_look"), 0.55, 1, 135);
  return out;
}

}  // namespace birdseye::host
