#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/base/result.hpp"

namespace birdseye::host {

/// RGB, 8 bits, rows from the top.
struct Picture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] RgbView view() const { return {rgb, width_px, height_px}; }
};

/// A PNG, JPEG or any other picture that OpenCV reads.
Result<Picture> read_picture(const std::filesystem::path& path);

/// The bytes of a PNG file.
std::string png_of(const RgbView& picture);
/// picture: not premultiplied.
std::string png_of(const RgbaView& picture);

/// Pictures of one size side by side, scaled by scale, in rows of columns.
Picture tile(std::span<const Picture> pictures, int columns, double scale);

void draw_cross(Picture& picture, const Eigen::Vector2d& centre_px);
void draw_circle(Picture& picture, const Eigen::Vector2d& centre_px);

/// Grey of an RGB picture, by the luma weights of BT.601.
std::vector<std::uint8_t> grey_of(const RgbView& picture);

}  // namespace birdseye::host
