#include "host/report/line_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/report/axes.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

/// What tells curves apart: a colour and, for prints without colours, dashes.
struct Style {
  const char* colour;
  const char* dashes;
};
constexpr Style kStyles[] = {{kBlue, "none"},      {kOrange, "7 3"},    {kGreen, "2 3"},
                             {kPurple, "9 3 2 3"}, {"#7a6a1e", "12 4"}, {"#555555", "4 2"}};

Range range_of(const Panel& panel, bool of_x) {
  Range range;
  for (const Curve& curve : panel.curves) {
    for (const auto& [x, y] : curve.points) range.include(of_x ? x : y);
  }
  if (of_x || range.high < range.low) return range;
  if (panel.from_zero) range.include(0);
  constexpr double kAbove = 0.05;
  range.high += kAbove * range.size();
  if (range.low != 0) range.low -= kAbove * range.size();
  return range;
}

/// Curves are told apart by the order in which their names first appear.
const Style& style_of(const std::string& name, const std::vector<Panel>& panels) {
  std::vector<std::string> seen;
  for (const Panel& panel : panels) {
    for (const Curve& curve : panel.curves) {
      if (std::find(seen.begin(), seen.end(), curve.name) == seen.end()) seen.push_back(curve.name);
    }
  }
  const auto at = static_cast<std::size_t>(std::find(seen.begin(), seen.end(), name) - seen.begin());
  return kStyles[at % std::size(kStyles)];
}

/// Further attributes of a line.
std::string drawn_as(const Style& style) {
  return fmt::format("stroke-width='1.8' stroke-dasharray='{}'", style.dashes);
}

/// The curves' names above the plot, where there are several; below: where its lines end.
std::string legend_svg(const Panel& panel, const std::vector<Panel>& all, double width, double& below) {
  constexpr double kLetter = 7.3, kBetween = 14, kLine = 16, kSample = 26, kGap = 5;
  if (panel.curves.size() < 2) return {};
  std::string out;
  double x = Axes::kLeft;
  below += kLine;
  for (const Curve& curve : panel.curves) {
    const double needed = kSample + kGap + kLetter * static_cast<double>(curve.name.size());
    if (x > Axes::kLeft && x + needed > width) {
      x = Axes::kLeft;
      below += kLine;
    }
    const Style& style = style_of(curve.name, all);
    out += svg_line(x, below - 4, x + kSample, below - 4, style.colour, drawn_as(style).c_str()) +
           svg_text(x + kSample + kGap, below, curve.name);
    x += needed + kBetween;
  }
  return out;
}

std::string curve_svg(const Curve& curve, const Axes& axes, const Style& style) {
  constexpr std::size_t kFew = 8;
  std::string out, line;
  const auto end_line = [&] {
    if (!line.empty())
      out += fmt::format("<polyline points='{}' fill='none' stroke='{}' {}/>", line, style.colour, drawn_as(style));
    line.clear();
  };
  for (const auto& [x, y] : curve.points) {
    if (!std::isfinite(x) || !std::isfinite(y)) {
      end_line();
      continue;
    }
    line += fmt::format("{:.1f},{:.1f} ", axes.x_of(x), axes.y_of(y));
    if (curve.points.size() <= kFew) out += svg_dot(axes.x_of(x), axes.y_of(y), 2.6, style.colour);
  }
  end_line();
  return out;
}

std::string panel_svg(const Panel& panel, const std::vector<Panel>& all, const PanelSize& size) {
  constexpr double kRight = 16;
  double head = 18;
  std::string svg = fmt::format("<g font-weight='bold'>{}</g>", svg_text(Axes::kLeft, head, panel.title));
  svg += legend_svg(panel, all, size.width, head);
  if (!panel.marks.empty()) head += 16;
  const double top = head + 10;
  const Axes axes({Axes::kLeft, top, size.width - Axes::kLeft - kRight, size.height - top - Axes::kBelow - 4},
                  {range_of(panel, true), panel.x_label, 5}, {range_of(panel, false), panel.y_label});
  svg += axes.svg();
  for (const Mark& mark : panel.marks) {
    svg += svg_line(axes.x_of(mark.x), top, axes.x_of(mark.x), top + axes.area().height, kGrey, kDashed) +
           svg_text(axes.x_of(mark.x), top - 4, mark.text, Anchor::start, kGrey);
  }
  for (const Curve& curve : panel.curves) svg += curve_svg(curve, axes, style_of(curve.name, all));
  return svg;
}

}  // namespace

std::string plot_svg(const std::vector<Panel>& panels, int columns, const PanelSize& size) {
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  std::string svg;
  for (std::size_t n = 0; n < panels.size(); ++n) {
    const int column = static_cast<int>(n) % columns, row = static_cast<int>(n) / columns;
    svg += fmt::format("<g transform='translate({} {})'>{}</g>\n", column * size.width, row * size.height,
                       panel_svg(panels[n], panels, size));
  }
  return svg_picture(columns * size.width, rows * size.height, svg);
}

}  // namespace birdseye::host
