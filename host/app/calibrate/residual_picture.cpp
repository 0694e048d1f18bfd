#include "host/app/calibrate/residual_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/app/calibrate/report_page.hpp"

namespace birdseye::host {

namespace {

constexpr double kWidth = 760;  ///< of every drawing, in units of the page

std::string open_svg(double height) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1:.0f}' viewBox='0 0 {0} {1:.0f}' role='img' "
      "font-family='DejaVu Sans, sans-serif' font-size='12'><rect width='100%' height='100%' fill='white'/>",
      kWidth, height);
}

/// The largest of 1, 2, 5 times a power of ten that is not above the value.
double round_down(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)));
  double out = unit;
  for (const double times : {2.0, 5.0}) {
    if (times * unit <= value) out = times * unit;
  }
  return out;
}

/// Residuals of exact data are of the order of rounding: no arrow is drawn for them.
constexpr double kNothing_px = 1e-6;

double magnification_for(std::span<const PixelResidual> residuals, double units_per_px) {
  constexpr double kReadable = 14;  // of the page: an arrow as long as a letter or two
  std::vector<double> lengths;
  for (const PixelResidual& r : residuals) {
    if (const double length = r.residual_px.norm(); std::isfinite(length)) lengths.push_back(length);
  }
  if (lengths.empty()) return 1;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return round_down(kReadable / units_per_px / std::max(*middle, kNothing_px));
}

std::string arrow(const Eigen::Vector2d& from, const Eigen::Vector2d& by, const char* colour) {
  const Eigen::Vector2d to = from + by;
  const double length = by.norm();
  std::string svg = fmt::format("<path d='M{:.1f} {:.1f}L{:.1f} {:.1f}", from.x(), from.y(), to.x(), to.y());
  if (length > 2) {
    const Eigen::Vector2d along = by / length * std::min(4.0, 0.4 * length);
    const Eigen::Vector2d across(-0.5 * along.y(), 0.5 * along.x());
    const Eigen::Vector2d left = to - along + across, right = to - along - across;
    svg += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}", left.x(), left.y(), to.x(), to.y(), right.x(),
                       right.y());
  }
  return svg + fmt::format("' stroke='{}' fill='none'/>", colour);
}

}  // namespace

std::string residual_picture_svg(std::span<const PixelResidual> residuals, int width_px, int height_px, double times) {
  constexpr std::size_t kMost = 3000;
  constexpr double kFoot = 26;
  const double scale = kWidth / std::max(width_px, 1);
  const double height = scale * height_px;
  if (!(times > 0)) times = magnification_for(residuals, scale);
  const std::size_t step = residuals.size() / kMost + 1;
  std::string svg = open_svg(height + kFoot);
  svg += fmt::format("<rect x='0.5' y='0.5' width='{}' height='{:.1f}' fill='#f7f8fa' stroke='#999'/>", kWidth - 1,
                     height - 1);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const PixelResidual& r = residuals[i];
    if ((i % step != 0 && !r.outlier) || !r.pixel_px.allFinite() || !r.residual_px.allFinite()) continue;
    if (r.residual_px.norm() < kNothing_px) continue;
    svg += arrow(scale * (r.pixel_px + Eigen::Vector2d(0.5, 0.5)), scale * times * r.residual_px,
                 r.outlier ? "#b3261e" : "#1b5e9e");
  }
  const double sample_px = round_down(60 / scale / times);
  svg += fmt::format("<path d='M8 {0:.1f}h{1:.1f}m0 -3v6m{2:.1f} 0v-6' stroke='#222' fill='none'/>", height + 14,
                     sample_px * times * scale, -sample_px * times * scale);
  svg += fmt::format("<text x='{:.1f}' y='{:.1f}'>{:g} px (drawn {:g} times as long{})</text></svg>\n",
                     16 + sample_px * times * scale, height + 18, sample_px, times,
                     step > 1 ? fmt::format(", one in {} of {}", step, residuals.size()) : std::string());
  return svg;
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
  std::string svg = open_svg(height);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int count = counts[static_cast<std::size_t>(row) * wide + static_cast<std::size_t>(column)];
      // The square root keeps a cell with few points apart from one with none.
      const double share = most > 0 ? std::sqrt(static_cast<double>(count) / most) : 0;
      svg += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#1b5e9e' fill-opacity='{:.2f}' "
          "stroke='#ccd'/>",
          column * cell_width, row * cell_height, cell_width, cell_height, 0.9 * share);
      svg += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle' fill='{}'>{}</text>",
                         (column + 0.5) * cell_width, (row + 0.5) * cell_height + 4,
                         count == 0     ? "#b3261e"
                         : share > 0.55 ? "white"
                                        : "#333",
                         count);
    }
  }
  return svg + "</svg>\n";
}

std::string bars_svg(const std::vector<Bar>& bars, const std::string& label, double limit) {
  constexpr double kRow = 18, kNames = 230, kValues = 70, kHead = 24;
  double most = limit;
  for (const Bar& bar : bars) {
    if (std::isfinite(bar.value)) most = std::max(most, bar.value);
  }
  const double height = kHead + kRow * static_cast<double>(bars.size()) + 6;
  const double room = kWidth - kNames - kValues;
  const auto length = [&](double value) { return most > 0 ? room * value / most : 0; };
  std::string svg =
      open_svg(height) + fmt::format("<text x='{}' y='15' fill='#555'>{}</text>", kNames, escape_html(label));
  double y = kHead;
  for (const Bar& bar : bars) {
    constexpr std::size_t kLongest = 32;
    const std::string name =
        bar.name.size() > kLongest ? "..." + bar.name.substr(bar.name.size() - kLongest + 3) : bar.name;
    const double drawn = std::isfinite(bar.value) ? length(bar.value) : 0;
    svg += fmt::format("<text x='{}' y='{}' text-anchor='end'>{}</text>", kNames - 8, y + 12, escape_html(name));
    svg += fmt::format("<rect x='{}' y='{}' width='{:.1f}' height='{}' fill='{}'/>", kNames, y + 2, drawn, kRow - 5,
                       bar.odd ? "#b3261e" : "#1b5e9e");
    svg += fmt::format("<text x='{:.1f}' y='{}'>{:.3g}</text>", kNames + drawn + 6, y + 12, bar.value);
    y += kRow;
  }
  if (limit > 0)
    svg += fmt::format("<path d='M{:.1f} {}V{}' stroke='#b26a00' stroke-dasharray='4 3'/>", kNames + length(limit),
                       kHead - 4, height - 4);
  return svg + "</svg>\n";
}

}  // namespace birdseye::host
