#include "host/app/png.hpp"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/app/json_file.hpp"

namespace birdseye::host {

Result<void> write_png(const std::filesystem::path& path, std::span<const std::uint8_t> pixels, int width_px,
                       int height_px, int channels) {
  const cv::Mat image(height_px, width_px, channels == 4 ? CV_8UC4 : CV_8UC3, const_cast<std::uint8_t*>(pixels.data()));
  cv::Mat swapped;
  cv::cvtColor(image, swapped, channels == 4 ? cv::COLOR_RGBA2BGRA : cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", swapped, bytes))
    return Error{Errc::io, fmt::format("{}: cannot be encoded", path.string())};
  return write_file(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace birdseye::host
