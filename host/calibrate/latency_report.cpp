#include "host/calibrate/latency_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

using calibration::Latency;
using calibration::StreamMotion;

constexpr double kShownS = 6;        // of the two motions: more would hide what a lag looks like
constexpr double kMostPoints = 600;  // of a curve

nlohmann::json json_of(const StreamMotion& motion) {
  return {{"samples", motion.samples},
          {"seconds", motion.seconds},
          {"recorded_s", motion.recorded_s},
          {"rate_hz", motion.rate_hz},
          {"longest_gap_s", motion.longest_gap_s},
          {"turn_speed_deg_s", motion.turn_speed_deg_s},
          {"shift_speed_mm_s", motion.shift_speed_mm_s},
          {"image_speed_px_s", motion.image_speed_px_s}};
}

/// What lies within half of kShownS of the middle.
Curve middle_of(const std::string& name, const std::vector<double>& times_s, const std::vector<double>& speeds,
                double later_s) {
  Curve curve{name, {}};
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double t = times_s[i] + later_s;
    if (std::abs(t) <= kShownS / 2) curve.points.emplace_back(t, speeds[i]);
  }
  const auto every = static_cast<std::size_t>(std::ceil(static_cast<double>(curve.points.size()) / kMostPoints));
  Curve thinned{name, {}};
  for (std::size_t i = 0; i < curve.points.size(); i += std::max<std::size_t>(1, every))
    thinned.points.push_back(curve.points[i]);
  return thinned;
}

Panel motions(const Latency& latency, const StreamNames& names, const std::string& title, double later_s) {
  return {title,
          "s from the middle of the recording",
          "speed, " + names.unit,
          {middle_of(names.a, latency.curves.a_s, latency.curves.a_speed, later_s),
           middle_of(names.b, latency.curves.b_s, latency.curves.b_speed, 0)}};
}

Panel scan(const Latency& latency) {
  Curve curve{"correlation", {}};
  for (std::size_t i = 0; i < latency.curves.lag_s.size(); ++i)
    curve.points.emplace_back(1e3 * latency.curves.lag_s[i], latency.curves.correlation[i]);
  return {"Correlation at each lag", "lag, ms", "correlation", {curve}};
}

Panel over_time(const Latency& latency) {
  const auto& curves = latency.curves;
  Curve parts{"parts", {}}, fit{"fit", {}}, band{"95 % of the fit", {}};
  std::vector<std::pair<double, double>> back;
  const double half_ms = latency.offset_ci95_ms[1] - latency.offset_ms;
  const double half_ppm = latency.drift_ci95_ppm[1] - latency.drift_ppm;
  for (std::size_t i = 0; i < curves.part_s.size(); ++i) {
    const double t = curves.part_s[i], line_ms = 1e-3 * latency.drift_ppm * t;
    const double band_ms = std::hypot(half_ms, 1e-3 * half_ppm * t);
    parts.points.emplace_back(t, curves.part_offset_ms[i] - latency.offset_ms);
    fit.points.emplace_back(t, line_ms);
    band.points.emplace_back(t, line_ms - band_ms);
    back.emplace_back(t, line_ms + band_ms);
  }
  band.points.insert(band.points.end(), back.rbegin(), back.rend());
  return {fmt::format("The offset over time, less {:.2f} ms", latency.offset_ms),
          "s from the middle of the recording",
          "offset, ms",
          {parts, fit, band}};
}

std::string range_text(double value, const std::array<double, 2>& interval, const char* unit) {
  return fmt::format("{:.2f} {} (95 %: {:.2f} to {:.2f})", value, unit, interval[0], interval[1]);
}

}  // namespace

nlohmann::json latency_json(const Latency& latency, const Verdict& verdict) {
  nlohmann::json json;
  const bool meant = latency.determined && verdict.grade != Grade::fail;
  json["offset_ms"] = meant ? nlohmann::json(latency.offset_ms) : nlohmann::json();
  json["offset_ci95_ms"] = meant ? nlohmann::json(latency.offset_ci95_ms) : nlohmann::json();
  json["drift_ppm"] = meant ? nlohmann::json(latency.drift_ppm) : nlohmann::json();
  json["drift_ci95_ppm"] = meant ? nlohmann::json(latency.drift_ci95_ppm) : nlohmann::json();
  json["at_s"] = latency.at_s;
  json["correlation"] = latency.correlation;
  json["best_lag_ms"] = 1e3 * latency.lag_s;
  json["rival_lag_ms"] = latency.rival_correlation > 0 ? nlohmann::json(1e3 * latency.rival_lag_s) : nlohmann::json();
  json["rival_correlation"] = latency.rival_correlation;
  json["rival_sigmas"] = latency.rival_sigmas;
  json["overlap_s"] = latency.overlap_s;
  json["residual"] = latency.residual;
  json["outlier_share"] = latency.outlier_share;
  json["motion"] = {{"a", json_of(latency.a)}, {"b", json_of(latency.b)}};
  return json;
}

HtmlPage latency_page(const Latency& latency, const Verdict& verdict, const StreamNames& names,
                      const std::string& advice) {
  HtmlPage page("Latency of the " + names.b + " against the " + names.a);
  const bool meant = latency.determined && verdict.grade != Grade::fail;
  if (meant) page.paragraph(advice);
  std::vector<std::vector<std::string>> rows{{"figure", ""}};
  if (meant) {
    rows.push_back({"offset", range_text(latency.offset_ms, latency.offset_ci95_ms, "ms")});
    rows.push_back({"drift", range_text(latency.drift_ppm, latency.drift_ci95_ppm, "ppm")});
  }
  rows.push_back({"correlation at the best lag", fmt::format("{:.3f}", latency.correlation)});
  rows.push_back({"in common", fmt::format("{:.1f} s", latency.overlap_s)});
  for (const auto& [name, m] : {std::pair{names.a, &latency.a}, std::pair{names.b, &latency.b}}) {
    std::string speed = fmt::format("{:.1f} deg/s", m->turn_speed_deg_s);
    if (m->shift_speed_mm_s > 0) speed += fmt::format(", {:.0f} mm/s", m->shift_speed_mm_s);
    if (m->image_speed_px_s > 0) speed = fmt::format("{:.0f} px/s", m->image_speed_px_s);
    rows.push_back({name, fmt::format("{} samples, {:.1f} Hz, moving by {}", m->samples, m->rate_hz, speed)});
  }
  page.table(rows);
  if (meant) {
    page.svg(plot_svg({motions(latency, names, "As they were stamped", 0),
                       motions(latency, names, "With the offset taken out", 1e-3 * latency.offset_ms)},
                      2),
             "Both motions for " + fmt::format("{:g}", kShownS) + " s. On the right one should hide the other.");
    page.svg(
        plot_svg({scan(latency), over_time(latency)}, 2),
        "Left: one peak, far above the rest, is what an offset rests on. Right: what parts of the recording ask for "
        "by themselves; a slope is drift, a step is a clock that jumped.");
  } else {
    page.svg(plot_svg({motions(latency, names, "As they were stamped", 0), scan(latency)}, 2),
             "Left: both motions. Right: an offset needs one peak that is far above the rest.");
  }
  return page;
}

}  // namespace birdseye::host
