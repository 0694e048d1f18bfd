#include "host/app/line_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr double kWidth = 380, kHeight = 284, kLeft = 52, kRight = 12, kTop = 58, kBottom = 42;
constexpr const char* kColours[] = {"#1b5e9e", "#d1622b", "#2c8a4b", "#8d4aa8", "#7a6a1e", "#555555"};

struct Range {
  double low, high;
};

/// Marks 1, 2 or 5 times a power of ten apart: some four of them.
std::vector<double> marks_of(const Range& range) {
  const double rough = (range.high - range.low) / 4;
  const double unit = std::pow(10, std::floor(std::log10(rough)));
  double apart = 10 * unit;
  for (const double times : {5.0, 2.0, 1.0}) {
    if (rough <= times * unit) apart = times * unit;
  }
  constexpr double kRounding = 1e-9;
  const int first = static_cast<int>(std::ceil(range.low / apart - kRounding));
  const int last = static_cast<int>(std::floor(range.high / apart + kRounding));
  std::vector<double> marks;
  for (int n = first; n <= last; ++n) marks.push_back(n * apart);
  return marks;
}

Range range_of(const Panel& panel, bool of_x) {
  Range range{1e300, -1e300};
  for (const Curve& curve : panel.curves) {
    for (const auto& [x, y] : curve.points) {
      range.low = std::min(range.low, of_x ? x : y);
      range.high = std::max(range.high, of_x ? x : y);
    }
  }
  if (range.low > range.high) return {0, 1};
  if (!of_x) range.low = std::min(range.low, 0.0);
  if (range.high - range.low < 1e-12) range.high = range.low + 1;
  if (!of_x) range.high += 0.04 * (range.high - range.low);
  return range;
}

/// Curves are told apart by the order in which their names first appear.
const char* colour_of(const std::string& name, const std::vector<Panel>& panels) {
  std::vector<std::string> seen;
  for (const Panel& panel : panels) {
    for (const Curve& curve : panel.curves) {
      if (std::find(seen.begin(), seen.end(), curve.name) == seen.end()) seen.push_back(curve.name);
    }
  }
  const auto at = static_cast<std::size_t>(std::find(seen.begin(), seen.end(), name) - seen.begin());
  return kColours[at % std::size(kColours)];
}

std::string panel_svg(const Panel& panel, const std::vector<Panel>& all) {
  const Range of_x = range_of(panel, true), of_y = range_of(panel, false);
  const auto x = [&](double v) { return kLeft + (kWidth - kLeft - kRight) * (v - of_x.low) / (of_x.high - of_x.low); };
  const auto y = [&](double v) {
    return kHeight - kBottom - (kHeight - kTop - kBottom) * (v - of_y.low) / (of_y.high - of_y.low);
  };
  std::string svg = fmt::format("<text x='{}' y='16' font-weight='bold'>{}</text>", kLeft, panel.title);
  for (const double v : marks_of(of_y)) {
    svg +=
        fmt::format("<path d='M{} {:.1f}H{}' stroke='#e4e4e4'/><text x='{}' y='{:.1f}' text-anchor='end'>{:.4g}</text>",
                    kLeft, y(v), kWidth - kRight, kLeft - 5, y(v) + 4, v);
  }
  for (const double v : marks_of(of_x)) {
    svg += fmt::format(
        "<path d='M{0:.1f} {1}v4' stroke='#888'/><text x='{0:.1f}' y='{2}' text-anchor='middle'>{3:.4g}</text>", x(v),
        kHeight - kBottom, kHeight - kBottom + 17, v);
  }
  svg += fmt::format("<path d='M{0} {1}V{2}H{3}' fill='none' stroke='#888'/>", kLeft, kTop, kHeight - kBottom,
                     kWidth - kRight);
  svg += fmt::format("<text x='{}' y='{}' text-anchor='middle' fill='#555'>{}</text>", (kLeft + kWidth) / 2,
                     kHeight - 8, panel.x_label);
  svg += fmt::format("<text transform='translate(13 {}) rotate(-90)' text-anchor='middle' fill='#555'>{}</text>",
                     (kTop + kHeight - kBottom) / 2, panel.y_label);
  double legend = kLeft, line = 34;
  for (const Curve& curve : panel.curves) {
    const char* const colour = colour_of(curve.name, all);
    std::string points;
    for (const auto& [px, py] : curve.points) points += fmt::format("{:.1f},{:.1f} ", x(px), y(py));
    svg += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.8'/>", points, colour);
    constexpr std::size_t kFew = 8;
    for (const auto& [px, py] : curve.points) {
      if (curve.points.size() <= kFew)
        svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.6' fill='{}'/>", x(px), y(py), colour);
    }
    constexpr double kLetter = 6.6, kLine = 14;
    const double width = kLetter * static_cast<double>(curve.name.size()) + 10;
    if (legend + width > kWidth) {
      legend = kLeft;
      line += kLine;
    }
    svg += fmt::format("<text x='{:.0f}' y='{}' fill='{}'>{}</text>", legend, line, colour, curve.name);
    legend += width;
  }
  return svg;
}

}  // namespace

std::string plot_svg(const std::vector<Panel>& panels, int columns) {
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} {1}' role='img' "
      "font-family='DejaVu Sans, sans-serif' font-size='11'><rect width='100%' height='100%' fill='white'/>",
      columns * kWidth, rows * kHeight);
  for (std::size_t n = 0; n < panels.size(); ++n) {
    const int column = static_cast<int>(n) % columns, row = static_cast<int>(n) / columns;
    svg += fmt::format("<g transform='translate({} {})'>{}</g>\n", column * kWidth, row * kHeight,
                       panel_svg(panels[n], panels));
  }
  return svg + "</svg>\n";
}

}  // namespace birdseye::host
