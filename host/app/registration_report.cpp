#include "host/app/registration_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace birdseye::host {

std::string trace_svg(const std::vector<TracePoint>& trace) {
  constexpr double kWidth = 760, kHeight = 220, kLeft = 60, kBottom = 30, kTop = 10;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' role='img' font-family='sans-serif' font-size='12'>"
      "<rect width='100%' height='100%' fill='white'/>",
      kWidth, kHeight);
  if (trace.empty()) return svg + "</svg>";
  const auto [least, most] = std::minmax_element(
      trace.begin(), trace.end(), [](const TracePoint& a, const TracePoint& b) { return a.similarity < b.similarity; });
  const double low = least->similarity, high = std::max(low + 1e-6, most->similarity);
  const auto x = [&](std::size_t i) {
    return kLeft + (kWidth - kLeft - 10) * static_cast<double>(i) /
                       static_cast<double>(std::max<std::size_t>(1, trace.size() - 1));
  };
  const auto y = [&](double value) { return kTop + (kHeight - kTop - kBottom) * (1 - (value - low) / (high - low)); };
  // A line for each stage: values of different resolutions or numbers of unknowns cannot be compared.
  std::string line;
  for (std::size_t i = 0; i < trace.size(); ++i) {
    const bool begins =
        i == 0 || trace[i].reduction != trace[i - 1].reduction || trace[i].parameters != trace[i - 1].parameters;
    if (begins) {
      if (!line.empty()) svg += fmt::format("<polyline fill='none' stroke='#246' points='{}'/>", line);
      line.clear();
      svg += fmt::format("<text x='{:.0f}' y='{}' fill='#666'>{}</text>", x(i), kHeight - 16, trace[i].parameters);
    }
    line += fmt::format("{:.1f},{:.1f} ", x(i), y(trace[i].similarity));
  }
  svg += fmt::format("<polyline fill='none' stroke='#246' points='{}'/>", line);
  svg += fmt::format("<text x='4' y='{:.0f}'>{:.3f}</text><text x='4' y='{:.0f}'>{:.3f}</text>", y(high) + 10, high,
                     y(low), low);
  return svg + fmt::format(
                   "<text x='{}' y='{}' fill='#666'>evaluations; each line is one stage, with its degrees of "
                   "freedom below; nats</text></svg>",
                   kLeft, kHeight - 3);
}

std::vector<std::uint8_t> difference_picture(const VideoView& view, const ImageRgba& overlay) {
  const std::size_t pixels = view.grey.size();
  std::vector<double> synthetic(pixels);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    synthetic[i] = 0.299 * overlay.rgba[4 * i] + 0.587 * overlay.rgba[4 * i + 1] + 0.114 * overlay.rgba[4 * i + 2];
    if (view.mask[i] == 0) continue;
    const double v = view.grey[i];
    n += 1;
    sx += synthetic[i];
    sy += v;
    sxx += synthetic[i] * synthetic[i];
    sxy += synthetic[i] * v;
  }
  const double spread = n * sxx - sx * sx;
  const double gain = spread > 0 ? (n * sxy - sx * sy) / spread : 0;
  const double offset = n > 0 ? (sy - gain * sx) / n : 0;
  std::vector<std::uint8_t> rgb(3 * pixels, 255);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (view.mask[i] == 0) {
      std::fill_n(rgb.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, std::uint8_t{128});
      continue;
    }
    constexpr double kContrast = 2;
    const double d = std::clamp(kContrast * (view.grey[i] - gain * synthetic[i] - offset), -255.0, 255.0);
    const auto rest = static_cast<std::uint8_t>(255 - std::abs(d));
    rgb[3 * i] = d > 0 ? 255 : rest;
    rgb[3 * i + 1] = rest;
    rgb[3 * i + 2] = d > 0 ? rest : 255;
  }
  return rgb;
}

std::string registration_report(const RegistrationCase& c, const ViewRegistration& found, const nlohmann::json& json) {
  std::string page =
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><title>Registration to views</title><style>"
      "body{font-family:sans-serif;max-width:70em;margin:1em auto}img{width:49%}table{border-collapse:collapse}"
      "td,th{border:1px solid #ccc;padding:.2em .6em;text-align:left}</style></head><body>";
  page += fmt::format("<h1>Registration to {} views: {}</h1><p>{}</p>", c.views.size(),
                      json["verdict"].get<std::string>(), json["reasons"][0].get<std::string>());
  page += "<table>";
  for (const auto& [key, value] : json.items()) {
    if (value.is_number()) page += fmt::format("<tr><th>{}</th><td>{:.6g}</td></tr>", key, value.get<double>());
    if (value.is_string()) page += fmt::format("<tr><th>{}</th><td>{}</td></tr>", key, value.get<std::string>());
  }
  page += "</table><h2>Similarity on the way</h2>" + trace_svg(found.trace);
  page +=
      "<h2>Views</h2><p>Overlay before and after; difference of grey before and after (red: the video is brighter; "
      "grey: not compared).</p>";
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    page += fmt::format("<h3>{}: {:.4f} to {:.4f} nats</h3>", c.views[n].name, found.per_view_before[n],
                        found.per_view_after[n]);
    for (const char* kind : {"before", "after", "difference_before", "difference_after"})
      page += fmt::format("<img src='view{}_{}.png' alt='{}'> ", n, kind, kind);
  }
  return page + "</body></html>\n";
}

}  // namespace birdseye::host
