#include "host/calibrate/field_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/report/axes.hpp"
#include "host/report/bar_chart.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

using calibration::FieldCheck;
using calibration::FieldFit;
using calibration::FieldResidual;

/// One slice of the box: x to the right, y up.
class SlicePanel {
 public:
  SlicePanel(const FieldFit& fit, double left, double top, double wide_px, double high_px, double stretch, bool first)
      : fit_(fit),
        low_(fit.map.data().functions.low_mm),
        high_(fit.map.data().functions.high_mm),
        axes_({left, top, wide_px, high_px}, axis_of(0, "x, mm", 4), axis_of(1, first ? "y, mm" : "", 5)),
        stretch_(stretch) {}

  [[nodiscard]] std::string ground(double z_mm) const {
    std::string out = axes_.svg();
    constexpr int kTiles = 24;
    const Eigen::Vector3d size = high_ - low_;
    for (int i = 0; i < kTiles * kTiles; ++i) {
      const double u = (i % kTiles + 0.5) / kTiles, v = (std::floor(1.0 * i / kTiles) + 0.5) / kTiles;
      const Eigen::Vector3d place(low_.x() + u * size.x(), low_.y() + v * size.y(), z_mm);
      if (fit_.map.sigma_mm(place)) continue;
      const double w = (axes_.x_of(high_.x()) - axes_.x_of(low_.x())) / kTiles;
      const double h = (axes_.y_of(low_.y()) - axes_.y_of(high_.y())) / kTiles;
      out += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#c9ced6' shape-rendering='crispEdges'/>",
          axes_.x_of(place.x()) - w / 2, axes_.y_of(place.y()) - h / 2, w + 0.2, h + 0.2);
    }
    return out;
  }

  [[nodiscard]] std::string arrow(const FieldResidual& residual, bool after) const {
    const Eigen::Vector3d from = residual.measured_mm - residual.before_mm;
    const double x = axes_.x_of(from.x()), y = axes_.y_of(from.y());
    if (residual.outlier) {
      return svg_line(x - 4, y - 4, x + 4, y + 4, kRed, "stroke-width='2'") +
             svg_line(x - 4, y + 4, x + 4, y - 4, kRed, "stroke-width='2'");
    }
    const Eigen::Vector3d to = from + stretch_ * (after ? residual.held_out_mm : residual.before_mm);
    return svg_dot(x, y, 1.6, kInk) +
           svg_line(x, y, axes_.x_of(to.x()), axes_.y_of(to.y()), after ? kBlue : kOrange, "stroke-width='1.6'");
  }

 private:
  /// With a margin for the arrows.
  [[nodiscard]] Axis axis_of(int which, const std::string& label, int ticks) const {
    const double margin_mm = 0.08 * (high_ - low_)[which];
    return {{low_[which] - margin_mm, high_[which] + margin_mm}, label, ticks};
  }

  const FieldFit& fit_;
  Eigen::Vector3d low_, high_;
  Axes axes_;
  double stretch_;
};

/// A chart of one column of a history.
std::string chart(const std::vector<FieldCheck>& history, double FieldCheck::*value, const std::string& title,
                  const std::string& label, const calibration::ControlLimits& limits, double top) {
  constexpr double kWidth = 730, kHeight = 150;
  const bool either_way = value != &FieldCheck::rms_mm;  // less of an error than usual is no fault
  Range range;
  range.include(0);
  for (const FieldCheck& day : history) range.include(day.*value);
  if (limits.days > 0) {
    range.include(limits.mean + 3 * limits.sigma);
    if (either_way) range.include(limits.mean - 3 * limits.sigma);
  }
  const double spare = 0.08 * std::max(range.size(), 1e-3);
  range.high += spare;
  if (either_way) range.low -= spare;
  const auto days = static_cast<double>(history.size());
  std::string between = history.front().when;
  if (history.size() > 1) between += " to " + history.back().when;
  const Axes axes({Axes::kLeft, top, kWidth, kHeight},
                  {{0.5, days + 0.5}, "day, " + between, static_cast<int>(std::min(days, 10.0))}, {range, label, 4});
  const double left = axes.area().left, right = left + kWidth;
  std::string out = fmt::format("<g font-weight='bold'>{}</g>", svg_text(left, top - 12, title)) + axes.svg();
  const auto level = [&](double v, const char* colour, const char* more, const char* name) {
    out += svg_line(left, axes.y_of(v), right, axes.y_of(v), colour, more) +
           svg_text(right + 6, axes.y_of(v) + 4, fmt::format("{} {:.2f}", name, v), Anchor::start, colour);
  };
  if (limits.days > 0) {
    level(limits.mean, kInk, "", "mean");
    level(limits.mean + 3 * limits.sigma, kRed, kDashed, "+3 sigma");
    if (either_way) level(limits.mean - 3 * limits.sigma, kRed, kDashed, "-3 sigma");
    const double learned = axes.x_of(limits.days + 0.5);
    out += svg_line(learned, top, learned, top + kHeight, kGrey, kDashed);
  }
  std::string points, dots;
  for (std::size_t i = 0; i < history.size(); ++i) {
    const double x = axes.x_of(static_cast<double>(i + 1)), y = axes.y_of(history[i].*value);
    points += fmt::format("{:.1f},{:.1f} ", x, y);
    const double above = history[i].*value - limits.mean;
    const bool out_of_it = limits.days > 0 && (either_way ? std::abs(above) : above) > 3 * limits.sigma;
    dots += svg_dot(x, y, out_of_it ? 5 : 3, out_of_it ? kRed : kBlue);
  }
  return out + fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.5'/>", points, kBlue) + dots;
}

}  // namespace

std::string field_arrows_svg(const FieldFit& fit) {
  constexpr double kSide = 190, kTicks = 44, kTop = 34;
  constexpr int kSlices = 4;
  const auto& box = fit.map.data().functions;
  const Eigen::Vector3d size = box.high_mm - box.low_mm;
  // The longest arrow is a sixth of the box, and none is more than ten times what it stands for.
  const double longest_mm = size.head<2>().maxCoeff() / 6;
  const double stretch = std::min(10.0, std::max(1.0, std::round(longest_mm / std::max(0.1, fit.before_worst_mm))));
  const Eigen::Vector2d panel_px = kSide / size.head<2>().maxCoeff() * size.head<2>();
  std::string body = svg_text(Axes::kLeft, 14,
                              fmt::format("from each dot, where it is, to where it was measured, drawn {:.0f} times as "
                                          "long",
                                          stretch));
  const double row = panel_px.y() + Axes::kBelow + 50, column = panel_px.x() + kTicks;
  for (int slice = 0; slice < kSlices; ++slice) {
    const double low_mm = box.low_mm.z() + size.z() * slice / kSlices;
    const double high_mm = low_mm + size.z() / kSlices;
    const bool last = slice == kSlices - 1;
    const double top = kTop + 36 + slice / 2 * row, left = Axes::kLeft + slice % 2 * 2 * column;
    body += svg_text(left, top - 24, fmt::format("z from {:.0f} to {:.0f} mm", low_mm, high_mm));
    for (const bool after : {false, true}) {
      const double x = left + (after ? column : 0);
      body += svg_text(x, top - 8, after ? "after, held out" : "before", Anchor::start, after ? kBlue : kOrange);
      const SlicePanel panel(fit, x, top, panel_px.x(), panel_px.y(), stretch, !after && slice % 2 == 0);
      body += panel.ground((low_mm + high_mm) / 2);
      for (const FieldResidual& r : fit.residuals) {
        const double z = r.measured_mm.z();
        if ((z >= low_mm && z < high_mm) || (last && z >= high_mm)) body += panel.arrow(r, after);
      }
    }
  }
  return svg_picture(Axes::kLeft + 4 * column, kTop + 2 * row, body);
}

std::string field_candidates_svg(const FieldFit& fit) {
  std::vector<Bar> bars{{"no map", fit.before_mm, kOrange}};
  for (const auto& c : fit.candidates) {
    const bool chosen = c.basis == fit.chosen.basis && c.order == fit.chosen.order;
    bars.push_back({fmt::format("{} {}", name_of(c.basis), c.order), c.held_out_mm, chosen ? kBlue : kPaleBlue});
  }
  return bars_svg(bars, "held-out error, mm RMS");
}

std::string field_chart_svg(const std::vector<FieldCheck>& history) {
  if (history.empty()) return svg_picture(10, 10, "");
  const auto limits = calibration::control_chart(history).value_or(calibration::ControlChart{});
  constexpr double kRow = 240;
  return svg_picture(
      910, 2 * kRow,
      chart(history, &FieldCheck::rms_mm, "Error of the plate's places", "error, mm RMS", limits.rms_mm, 32) +
          chart(history, &FieldCheck::scale_percent, "The tracker's scale against the plate", "off by, %",
                limits.scale_percent, 32 + kRow));
}

}  // namespace birdseye::host
