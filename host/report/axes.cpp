#include "host/report/axes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kAxis = "#888";

Range sound(const Range& range) {
  if (!(range.high >= range.low)) return {0, 1};
  const double least = 1e-9 * std::max({std::abs(range.low), std::abs(range.high), 1e-3});
  return range.size() > least ? range : Range{range.low, range.low + 1};
}

struct Ticks {
  std::vector<double> values;
  int digits = 0;  ///< behind the point
};

Ticks ticks_of(const Axis& axis) {
  Ticks ticks;
  if (axis.ticks <= 0) return ticks;
  const double step = round_up(axis.range.size() / axis.ticks);
  constexpr double kRounding = 1e-9;
  ticks.digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + kRounding)));
  const double first = std::ceil(axis.range.low / step - kRounding);
  const auto count = static_cast<int>(std::floor(axis.range.high / step + kRounding) - first) + 1;
  for (int n = 0; n < count; ++n) ticks.values.push_back((first + n) * step);
  return ticks;
}

std::string number(double value, int digits) {
  constexpr int kMostDigits = 5;
  if (digits > kMostDigits || std::abs(value) >= 1e6) return fmt::format("{:.3g}", value);
  return fmt::format("{:.{}f}", value == 0 ? 0.0 : value, digits);  // there is no -0
}

}  // namespace

double round_up(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)));
  for (const double times : {1.0, 2.0, 5.0}) {
    if (value <= times * unit) return times * unit;
  }
  return 10 * unit;
}

double round_down(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)));
  for (const double times : {5.0, 2.0}) {
    if (times * unit <= value) return times * unit;
  }
  return unit;
}

void Range::include(double value) {
  if (!std::isfinite(value)) return;
  low = std::min(low, value);
  high = std::max(high, value);
}

Axes::Axes(const PlotArea& area, Axis x, Axis y) : area_(area), x_(std::move(x)), y_(std::move(y)) {
  x_.range = sound(x_.range);
  y_.range = sound(y_.range);
}

double Axes::x_of(double value) const {
  return area_.left + area_.width * (value - x_.range.low) / x_.range.size();
}

double Axes::y_of(double value) const {
  return area_.top + area_.height * (1 - (value - y_.range.low) / y_.range.size());
}

std::string Axes::svg() const {
  const double bottom = area_.top + area_.height, right = area_.left + area_.width;
  std::string out;
  const Ticks across = ticks_of(x_), up = ticks_of(y_);
  for (const double v : across.values) {
    out += svg_line(x_of(v), area_.top, x_of(v), bottom, kFaint) +
           svg_line(x_of(v), bottom, x_of(v), bottom + 4, kAxis) +
           svg_text(x_of(v), bottom + 17, number(v, across.digits), Anchor::middle);
  }
  for (const double v : up.values) {
    out += svg_line(area_.left, y_of(v), right, y_of(v), kFaint) +
           svg_line(area_.left - 4, y_of(v), area_.left, y_of(v), kAxis) +
           svg_text(area_.left - 7, y_of(v) + 4, number(v, up.digits), Anchor::end);
  }
  out += fmt::format("<path d='M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}' fill='none' stroke='{4}'/>", area_.left, area_.top,
                     bottom, right, kAxis);
  out += svg_text(area_.left + area_.width / 2, bottom + 34, x_.label, Anchor::middle, kGrey);
  out += fmt::format("<g transform='translate({:.1f} {:.1f}) rotate(-90)'>{}</g>\n", area_.left - kLeft + 13,
                     area_.top + area_.height / 2, svg_text(0, 0, y_.label, Anchor::middle, kGrey));
  return out;
}

std::string rings_svg(double middle_x, double middle_y, double radius, double outer_deg, double apart_deg) {
  std::string out;
  for (int k = 1; k * apart_deg <= outer_deg; ++k) {
    const double r = radius * k * apart_deg / outer_deg;
    out +=
        fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none' stroke='#ccc'/>", middle_x, middle_y, r) +
        svg_text(middle_x + 3, middle_y - r - 2, fmt::format("{:g}\u00b0", k * apart_deg), Anchor::start, kGrey);
  }
  return out + fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none' stroke='{}'/>\n", middle_x, middle_y,
                           radius, kAxis);
}

}  // namespace birdseye::host
