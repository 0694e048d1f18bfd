#include "host/calibrate/residual_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/report/axes.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

constexpr double kWidth = 760;  ///< of every drawing, in units of the page

/// Residuals of exact data are of the order of rounding: no arrow is drawn for them.
constexpr double kNothing_px = 1e-6;

double magnification_for(std::span<const PixelResidual> residuals, double units_per_px) {
  constexpr double kReadable = 14;  // of the page: an arrow as long as a letter or two
  std::vector<double> lengths;
  for (const PixelResidual& r : residuals) {
    if (const double length = r.residual_px.norm(); std::isfinite(length)) lengths.push_back(length);
  }
  if (lengths.empty()) return 1;
  return round_down(kReadable / units_per_px / std::max(median_of(std::move(lengths)), kNothing_px));
}

}  // namespace

std::string residual_picture_svg(std::span<const PixelResidual> residuals, int width_px, int height_px, double times,
                                 const std::string& image) {
  constexpr std::size_t kMost = 3000;
  constexpr double kFoot = 26, kLongest = 60;
  const double scale = kWidth / std::max(width_px, 1);
  const double height = scale * height_px;
  if (!(times > 0)) times = magnification_for(residuals, scale);
  const std::size_t step = residuals.size() / kMost + 1;
  bool cut = false;
  std::string svg = fmt::format(
      "<svg width='{0}' height='{2:.1f}'>"  // which cuts off what would lie outside
      "<rect x='0.5' y='0.5' width='{1}' height='{3:.1f}' fill='#f7f8fa' stroke='#999'/>",
      kWidth, kWidth - 1, height, height - 1);
  // Pale, so that arrows of every colour stand out.
  if (!image.empty())
    svg += fmt::format("<image href='{}' width='{}' height='{:.1f}' opacity='0.55'/>", image, kWidth, height);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const PixelResidual& r = residuals[i];
    if ((i % step != 0 && !r.outlier) || !r.pixel_px.allFinite() || !r.residual_px.allFinite()) continue;
    if (r.residual_px.norm() < kNothing_px) continue;
    Eigen::Vector2d drawn = scale * times * r.residual_px;
    if (drawn.norm() > kLongest) {  // it would hide others
      drawn *= kLongest / drawn.norm();
      cut = true;
    }
    const Eigen::Vector2d from = scale * (r.pixel_px + Eigen::Vector2d(0.5, 0.5));
    svg += svg_arrow(from.x(), from.y(), from.x() + drawn.x(), from.y() + drawn.y(), r.outlier ? kRed : kBlue);
  }
  svg += "</svg>";
  const double sample_px = round_down(60 / scale / times);
  svg += fmt::format("<path d='M8 {0:.1f}h{1:.1f}m0 -3v6m{2:.1f} 0v-6' stroke='#222' fill='none'/>", height + 14,
                     sample_px * times * scale, -sample_px * times * scale);
  svg += svg_text(16 + sample_px * times * scale, height + 18,
                  fmt::format("{:g} px (drawn {:g} times as long{}{})", sample_px, times,
                              cut ? fmt::format(", what is over {:.2g} px cut to that", kLongest / scale / times) : "",
                              step > 1 ? fmt::format(", one in {} of {}", step, residuals.size()) : std::string()));
  return svg_picture(kWidth, height + kFoot, svg);
}

std::string coverage_picture_svg(std::span<const Eigen::Vector2d> points_px, int width_px, int height_px, int columns,
                                 int rows) {
  const auto wide = static_cast<std::size_t>(columns);
  std::vector<int> counts(wide * static_cast<std::size_t>(rows), 0);
  for (const Eigen::Vector2d& p : points_px) {
    const double column = (p.x() + 0.5) * columns / width_px, row = (p.y() + 0.5) * rows / height_px;
    if (!(column >= 0 && row >= 0 && column < columns && row < rows)) continue;
    ++counts[static_cast<std::size_t>(row) * wide + static_cast<std::size_t>(column)];
  }
  const int most = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
  const double height = kWidth * height_px / std::max(width_px, 1);
  const double cell_width = kWidth / columns, cell_height = height / rows;
  std::string svg;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int count = counts[static_cast<std::size_t>(row) * wide + static_cast<std::size_t>(column)];
      // The square root keeps a cell with few points apart from one with none.
      const double share = most > 0 ? std::sqrt(static_cast<double>(count) / most) : 0;
      svg += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#1b5e9e' fill-opacity='{:.2f}' "
          "stroke='#ccd'/>",
          column * cell_width, row * cell_height, cell_width, cell_height, 0.9 * share);
      svg += svg_text((column + 0.5) * cell_width, (row + 0.5) * cell_height + 4, std::to_string(count), Anchor::middle,
                      count == 0     ? kRed
                      : share > 0.55 ? "white"
                                     : kInk);
    }
  }
  return svg_picture(kWidth, height, svg);
}

}  // namespace birdseye::host
