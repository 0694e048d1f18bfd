#include "hw-sim/video/post_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::uint32_t kColumns = 4096, kRows = 2048;  // once round the axis; along it
constexpr double kRowsPerMm = 12;                       // on the post; on the wall fewer, so that both look alike

/// Smooth noise from 0 to 1, in cells of so many columns and rows. Its last column joins its first.
double smooth_noise(std::uint64_t seed, std::uint32_t column, std::uint32_t row, std::uint32_t cell) {
  const auto at = [seed](std::uint32_t x, std::uint32_t y) {
    return hashed_uniform(seed, (static_cast<std::uint64_t>(y) << 32U) | x);
  };
  const auto eased = [](double part) { return part * part * (3 - 2 * part); };
  const std::uint32_t cells = kColumns / cell, left = column / cell, above = row / cell;
  const std::uint32_t right = (left + 1) % cells, below = above + 1;
  const double x = eased(static_cast<double>(column % cell) / cell), y = eased(static_cast<double>(row % cell) / cell);
  return std::lerp(std::lerp(at(left, above), at(right, above), x), std::lerp(at(left, below), at(right, below), x), y);
}

}  // namespace

PostView::PostView(int width_px, int height_px) : pattern_(std::size_t{kColumns} * kRows) {
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const double light = 0.40 * smooth_noise(1, column, row, 128) + 0.25 * smooth_noise(2, column, row, 64) +
                           0.20 * smooth_noise(3, column, row, 32) + 0.15 * smooth_noise(4, column, row, 16);
      pattern_[std::size_t{row} * kColumns + column] = static_cast<std::uint8_t>(std::lround(255 * light));
    }
  }
  for (std::size_t light = 0; light < colours_.size(); ++light) {
    const auto part = [light](double most) {
      return static_cast<std::uint8_t>(most * static_cast<double>(light) / 255);
    };
    colours_[light] = {part(230), part(150), part(130)};
  }

  const double focal_px = kFocalPerWidth * width_px;
  places_.reserve(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      const double x = (u - width_px / 2.0) / focal_px, y = (v - height_px / 2.0) / focal_px;
      // The ray is at (kFromAxisMm - s, s x) across the axis, s mm before the scope: where it first meets the post, or
      // else where it leaves the wall.
      const double a = 1 + x * x;
      const auto hit = [a](double radius_mm, double sign) {
        const double under = kFromAxisMm * kFromAxisMm - a * (kFromAxisMm * kFromAxisMm - radius_mm * radius_mm);
        return under < 0 ? -1.0 : (kFromAxisMm + sign * std::sqrt(under)) / a;
      };
      double s = hit(kPostRadiusMm, -1), rows_per_mm = kRowsPerMm;
      if (s < 0) {
        s = hit(kWallRadiusMm, 1);
        rows_per_mm *= kPostRadiusMm / kWallRadiusMm;
      }
      const double turns = std::atan2(s * x, kFromAxisMm - s) / (2 * std::numbers::pi);
      const double row = std::clamp(kRows / 2.0 - s * y * rows_per_mm, 0.0, kRows - 1.0);
      places_.push_back({static_cast<std::uint32_t>(std::lround((turns + 1) * kColumns)) % kColumns,
                         static_cast<std::uint32_t>(row) * kColumns});
    }
  }
  picture_.resize(3 * places_.size());
}

std::span<const std::uint8_t> PostView::draw(double angle_rad) {
  const double turns = angle_rad / (2 * std::numbers::pi);
  const auto turned = static_cast<std::uint32_t>(std::lround((turns - std::floor(turns)) * kColumns));
  std::uint8_t* out = picture_.data();
  for (const Place& place : places_) {
    const auto& colour = colours_[pattern_[place.row + (place.angle + turned) % kColumns]];
    out = std::copy(colour.begin(), colour.end(), out);
  }
  return picture_;
}

}  // namespace birdseye::hw_sim
