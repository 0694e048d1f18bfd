#include "host/app/calibrate/field_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

using calibration::FieldCheck;
using calibration::FieldFit;
using calibration::FieldResidual;

constexpr const char* kBlue = "#1b5e9e";
constexpr const char* kOrange = "#d1622b";
constexpr const char* kRed = "#b3261e";
constexpr const char* kText = "font-family='system-ui,sans-serif' font-size='12' fill='#333'";

std::string text(double x, double y, const std::string& what, const char* anchor = "start") {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}' {}>{}</text>", x, y, anchor, kText, what);
}

std::string line(double x1, double y1, double x2, double y2, const char* colour, const char* more = "") {
  return fmt::format("<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' stroke='{}' {}/>", x1, y1, x2, y2, colour,
                     more);
}

std::string svg(double width, double height, const std::string& body) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' viewBox='0 0 {0:.0f} {1:.0f}'>"
      "<rect width='100%' height='100%' fill='white'/>{2}</svg>",
      width, height, body);
}

/// One slice of the box, drawn into a panel: x to the right, y up.
class SlicePanel {
 public:
  SlicePanel(const FieldFit& fit, double left, double top, double side, double stretch)
      : fit_(fit), left_(left), top_(top), stretch_(stretch) {
    const auto& box = fit.map.data().functions;
    low_ = box.low_mm;
    size_ = box.high_mm - box.low_mm;
    px_per_mm_ = side / std::max(size_.x(), size_.y());
  }

  [[nodiscard]] double width() const { return size_.x() * px_per_mm_; }
  [[nodiscard]] double height() const { return size_.y() * px_per_mm_; }

  [[nodiscard]] std::string ground(double z_mm) const {
    std::string out = fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#f4f6f8'/>", left_,
                                  top_, width(), height());
    constexpr int kTiles = 24;
    for (int i = 0; i < kTiles * kTiles; ++i) {
      const double u = (i % kTiles + 0.5) / kTiles, v = (std::floor(1.0 * i / kTiles) + 0.5) / kTiles;
      const Eigen::Vector3d place(low_.x() + u * size_.x(), low_.y() + v * size_.y(), z_mm);
      if (fit_.map.sigma_mm(place)) continue;
      const double w = width() / kTiles, h = height() / kTiles;
      out += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='#c9ced6' shape-rendering='crispEdges'/>",
          x_of(place.x()) - w / 2, y_of(place.y()) - h / 2, w, h);
    }
    return out;
  }

  [[nodiscard]] std::string arrow(const FieldResidual& residual, bool after) const {
    const Eigen::Vector3d& off = after ? residual.held_out_mm : residual.before_mm;
    const Eigen::Vector3d from = residual.measured_mm - residual.before_mm;
    const double x = x_of(from.x()), y = y_of(from.y());
    if (residual.outlier) {
      return line(x - 4, y - 4, x + 4, y + 4, kRed, "stroke-width='2'") +
             line(x - 4, y + 4, x + 4, y - 4, kRed, "stroke-width='2'");
    }
    const double dx = off.x() * px_per_mm_ * stretch_, dy = -off.y() * px_per_mm_ * stretch_;
    return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='1.6' fill='#333'/>", x, y) +
           line(x, y, x + dx, y + dy, after ? kBlue : kOrange, "stroke-width='1.6'");
  }

 private:
  [[nodiscard]] double x_of(double x_mm) const { return left_ + (x_mm - low_.x()) * px_per_mm_; }
  [[nodiscard]] double y_of(double y_mm) const { return top_ + (low_.y() + size_.y() - y_mm) * px_per_mm_; }

  const FieldFit& fit_;
  double left_, top_, stretch_, px_per_mm_ = 1;
  Eigen::Vector3d low_, size_;
};

double nice_top(double value) {
  for (const double top : {0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
    if (value <= top) return top;
  }
  return value;
}

/// A chart of one column of a history.
std::string chart(const std::vector<FieldCheck>& history, double FieldCheck::*value, const std::string& title,
                  const calibration::ControlLimits& limits, double top) {
  constexpr double kLeft = 60, kWidth = 780, kHeight = 150;
  double low = 0, high = 0;
  for (const FieldCheck& day : history) {
    low = std::min(low, day.*value);
    high = std::max(high, day.*value);
  }
  if (limits.days > 0) {
    low = std::min(low, limits.mean - 3 * limits.sigma) - 0.2 * limits.sigma;
    high = std::max(high, limits.mean + 3 * limits.sigma);
  }
  if (value == &FieldCheck::rms_mm) low = 0;
  const double spare = 0.08 * std::max(high - low, 1e-3);
  const auto y_of = [&](double v) { return top + kHeight * (1 - (v - low) / (high + spare - low)); };
  const auto x_of = [&](std::size_t day) {
    return kLeft + kWidth * (static_cast<double>(day) + 0.5) / static_cast<double>(history.size());
  };
  std::string out = text(kLeft, top - 10, title) + line(kLeft, top, kLeft, top + kHeight, "#99a") +
                    line(kLeft, top + kHeight, kLeft + kWidth, top + kHeight, "#99a");
  const auto level = [&](double v, const char* colour, const char* dashes, const char* name) {
    if (v < low) return;
    out += line(kLeft, y_of(v), kLeft + kWidth, y_of(v), colour, dashes) +
           text(kLeft - 6, y_of(v) + 4, fmt::format("{:.2f}", v), "end") + text(kLeft + kWidth + 6, y_of(v) + 4, name);
  };
  if (limits.days > 0) {
    level(limits.mean, "#2c8a4b", "", "mean");
    level(limits.mean + 3 * limits.sigma, kRed, "stroke-dasharray='6 4'", "+3 sigma");
    if (value != &FieldCheck::rms_mm)  // less than usual is no fault
      level(limits.mean - 3 * limits.sigma, kRed, "stroke-dasharray='6 4'", "-3 sigma");
    const double learned = kLeft + kWidth * limits.days / static_cast<double>(history.size());
    out += line(learned, top, learned, top + kHeight, "#99a", "stroke-dasharray='2 3'") +
           text(learned - 4, top + kHeight + 16, "limits from the days before", "end");
  } else {
    level(high, "#dde", "", "");
  }
  std::string points;
  for (std::size_t i = 0; i < history.size(); ++i)
    points += fmt::format("{:.1f},{:.1f} ", x_of(i), y_of(history[i].*value));
  out += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.5'/>", points, kBlue);
  for (std::size_t i = 0; i < history.size(); ++i) {
    const double above = history[i].*value - limits.mean;
    const double off = value == &FieldCheck::rms_mm ? above : std::abs(above);
    const bool out_of_it = limits.days > 0 && off > 3 * limits.sigma;
    out += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'/>", x_of(i), y_of(history[i].*value),
                       out_of_it ? 5 : 3, out_of_it ? kRed : kBlue);
  }
  return out + text(kLeft, top + kHeight + 16, history.front().when) +
         (history.size() > 1 ? text(kLeft + kWidth, top + kHeight + 16, history.back().when, "end") : "");
}

}  // namespace

std::string field_arrows_svg(const FieldFit& fit) {
  constexpr double kSide = 230, kGap = 64, kTop = 44, kApart = 50;
  constexpr int kSlices = 4;
  const auto& box = fit.map.data().functions;
  const Eigen::Vector3d size = box.high_mm - box.low_mm;
  // The longest arrow is a sixth of the box, and none is more than ten times what it stands for.
  const double stretch =
      std::min(10.0, std::max(1.0, std::round(size.head<2>().maxCoeff() / 6 / std::max(0.1, fit.before_worst_mm))));
  const SlicePanel first(fit, 0, 0, kSide, stretch);
  std::string body =
      text(20, 20,
           fmt::format("from each dot, where it is, to where it was measured, drawn {:.0f} times as long: before "
                       "(left, orange) and after (right, blue)",
                       stretch));
  const double row = first.height() + 70, pair = 2 * first.width() + kApart;
  for (int slice = 0; slice < kSlices; ++slice) {
    const double low_mm = box.low_mm.z() + size.z() * slice / kSlices;
    const double high_mm = low_mm + size.z() / kSlices;
    const int line = slice / 2;
    const double top = kTop + 36 + line * row, left = 20 + (slice % 2) * (pair + kGap);
    body += text(left, top - 20, fmt::format("z from {:.0f} to {:.0f} mm", low_mm, high_mm));
    for (const bool after : {false, true}) {
      const SlicePanel panel(fit, left + (after ? first.width() + kApart : 0), top, kSide, stretch);
      body += panel.ground((low_mm + high_mm) / 2);
      for (const FieldResidual& r : fit.residuals) {
        const double z = r.measured_mm.z();
        const bool last = slice == kSlices - 1 && z >= high_mm;
        if ((z >= low_mm && z < high_mm) || last) body += panel.arrow(r, after);
      }
    }
  }
  return svg(20 + 2 * pair + kGap + 20, kTop + 16 + 2 * row, body);
}

std::string field_candidates_svg(const FieldFit& fit) {
  constexpr double kLeft = 130, kWidth = 560, kRow = 22;
  double most = fit.before_mm;
  for (const auto& c : fit.candidates) most = std::max(most, c.held_out_mm);
  const double top_mm = nice_top(most);
  std::string body;
  double y = 14;
  const auto bar = [&](const std::string& name, double value_mm, const char* colour) {
    body += text(kLeft - 8, y + 12, name, "end") +
            fmt::format("<rect x='{}' y='{:.1f}' width='{:.1f}' height='15' fill='{}'/>", kLeft, y,
                        std::max(1.0, kWidth * value_mm / top_mm), colour) +
            text(kLeft + kWidth * value_mm / top_mm + 6, y + 12, fmt::format("{:.2f} mm", value_mm));
    y += kRow;
  };
  bar("no map", fit.before_mm, kOrange);
  for (const auto& c : fit.candidates) {
    const bool chosen = c.basis == fit.chosen.basis && c.order == fit.chosen.order;
    bar(fmt::format("{} {}", name_of(c.basis), c.order), c.held_out_mm, chosen ? kBlue : "#a9c3dd");
  }
  return svg(kLeft + kWidth + 90, y + 6, body);
}

std::string field_chart_svg(const std::vector<FieldCheck>& history) {
  if (history.empty()) return svg(10, 10, "");
  const auto limits = calibration::control_chart(history).value_or(calibration::ControlChart{});
  return svg(930, 450,
             chart(history, &FieldCheck::rms_mm, "error of the plate's places, mm RMS", limits.rms_mm, 36) +
                 chart(history, &FieldCheck::scale_percent, "the tracker's scale against the plate, %",
                       limits.scale_percent, 256));
}

}  // namespace birdseye::host
