#include "host/files/picture.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/picture/picture_mat.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/read_mat.hpp"

namespace birdseye::host {

namespace {

const cv::Scalar kMark(255, 255, 255), kRim(0, 0, 0);

/// The picture's own pixels, for OpenCV to draw on.
cv::Mat view_of(Picture& picture) {
  return {picture.height_px, picture.width_px, CV_8UC3, picture.rgb.data()};
}

std::string png_of(const cv::Mat& image, cv::ColorConversionCodes to_opencv) {
  cv::Mat swapped;
  cv::cvtColor(image, swapped, to_opencv);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", swapped, bytes);
  return {bytes.begin(), bytes.end()};
}

cv::Point point_of(const Eigen::Vector2d& p) {
  return {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
}

}  // namespace

Result<Picture> read_picture(const std::filesystem::path& path) {
  if (const auto file = open_file(path); !file) return file.error();
  const auto read = read_bgr_mat(path);
  if (!read && read.error().code == Errc::bad_format)
    return Error{Errc::bad_format, path.string() + ": is no picture; give a PNG or JPEG"};
  if (!read) return read.error().with_context(path.string());
  Picture picture{read->cols, read->rows, {}};
  picture.rgb.resize(3 * read->total());
  cv::Mat rgb = view_of(picture);
  cv::cvtColor(*read, rgb, cv::COLOR_BGR2RGB);
  return picture;
}

std::string png_of(const RgbView& picture) {
  return png_of(mat_of(picture), cv::COLOR_RGB2BGR);
}

std::string png_of(const RgbaView& picture) {
  return png_of(mat_of(picture), cv::COLOR_RGBA2BGRA);
}

Picture tile(std::span<const Picture> pictures, int columns, double scale) {
  Picture out;
  if (pictures.empty()) return out;
  const int width = static_cast<int>(pictures[0].width_px * scale);
  const int height = static_cast<int>(pictures[0].height_px * scale);
  const int count = static_cast<int>(pictures.size());
  out.width_px = width * std::min(columns, count);
  out.height_px = height * ((count + columns - 1) / columns);
  out.rgb.resize(static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px) * 3);
  cv::Mat canvas = view_of(out);
  for (int i = 0; i < count; ++i) {
    const Picture& p = pictures[static_cast<std::size_t>(i)];
    cv::Mat cell = canvas(cv::Rect(i % columns * width, i / columns * height, width, height));
    cv::resize(mat_of(p.view()), cell, cell.size(), 0, 0, cv::INTER_AREA);
  }
  return out;
}

void draw_cross(Picture& picture, const Eigen::Vector2d& centre_px) {
  cv::Mat image = view_of(picture);
  cv::drawMarker(image, point_of(centre_px), kRim, cv::MARKER_CROSS, 18, 4, cv::LINE_AA);
  cv::drawMarker(image, point_of(centre_px), kMark, cv::MARKER_CROSS, 18, 2, cv::LINE_AA);
}

void draw_circle(Picture& picture, const Eigen::Vector2d& centre_px) {
  cv::Mat image = view_of(picture);
  cv::circle(image, point_of(centre_px), 14, kRim, 3, cv::LINE_AA);
  cv::circle(image, point_of(centre_px), 14, kMark, 1, cv::LINE_AA);
}

std::vector<std::uint8_t> grey_of(const RgbView& picture) {
  std::vector<std::uint8_t> grey(picture.area_px());
  cv::Mat out(picture.height_px, picture.width_px, CV_8UC1, grey.data());
  cv::cvtColor(mat_of(picture), out, cv::COLOR_RGB2GRAY);
  return grey;
}

}  // namespace birdseye::host
