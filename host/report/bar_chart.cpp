#include "host/report/bar_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

std::string bars_svg(const std::vector<Bar>& bars, const std::string& label) {
  constexpr double kWidth = 760, kRow = 18, kNames = 230, kValues = 70, kHead = 24;
  double most = 0;
  for (const Bar& bar : bars) {
    if (std::isfinite(bar.value)) most = std::max(most, bar.value);
  }
  std::string svg = svg_text(kNames, 15, label, Anchor::start, kGrey);
  double y = kHead;
  for (const Bar& bar : bars) {
    constexpr std::size_t kLongest = 30;
    const std::string name =
        bar.name.size() > kLongest ? "..." + bar.name.substr(bar.name.size() - kLongest + 3) : bar.name;
    const double drawn =
        most > 0 && std::isfinite(bar.value) ? (kWidth - kNames - kValues) * std::max(0.0, bar.value) / most : 0;
    svg += svg_text(kNames - 8, y + 12, name, Anchor::end);
    svg += fmt::format("<rect x='{}' y='{}' width='{:.1f}' height='{}' fill='{}'/>", kNames, y + 2, drawn, kRow - 5,
                       bar.colour);
    svg += svg_text(kNames + drawn + 6, y + 12, fmt::format("{:.3g}", bar.value));
    y += kRow;
  }
  return svg_picture(kWidth, y + 6, svg);
}

}  // namespace birdseye::host
