#include "host/app/demo_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/app/write_files.hpp"

namespace birdseye::host {

namespace {

std::vector<double> column(const std::vector<FrameError>& errors, double FrameError::*field) {
  std::vector<double> out;
  out.reserve(errors.size());
  for (const FrameError& e : errors) out.push_back(e.*field);
  return out;
}

/// One line over time as an inline SVG, with its axes named.
std::string plot(const std::vector<FrameError>& errors, double FrameError::*field, const std::string& unit) {
  if (errors.empty()) return "<p>No frame carried an overlay.</p>";
  constexpr double kWidth = 760, kHeight = 180, kLeft = 52, kBottom = 30, kTop = 10;
  const std::vector<double> values = column(errors, field);
  const double top = std::max(1e-9, *std::max_element(values.begin(), values.end())) * 1.1;
  const double end_s = std::max(1e-9, errors.back().time_s);
  const double plot_width = kWidth - kLeft - 10;
  const double plot_height = kHeight - kBottom - kTop;
  // A line for each run of frames: where the overlay was hidden there is nothing to draw.
  constexpr double kGap_s = 0.2;
  std::string lines;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (i == 0 || errors[i].time_s - errors[i - 1].time_s > kGap_s) {
      lines += std::string(i == 0 ? "" : "'/>") + "<polyline points='";
    }
    lines += fmt::format("{:.1f},{:.1f} ", kLeft + plot_width * errors[i].time_s / end_s,
                         kTop + plot_height * (1 - values[i] / top));
  }
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img'>", kWidth, kHeight);
  for (int i = 0; i <= 4; ++i) {
    const double y = kTop + plot_height * i / 4;
    svg += fmt::format("<line x1='{}' y1='{:.1f}' x2='{}' y2='{:.1f}' class='grid'/>", kLeft, y, kWidth - 10, y);
    svg += fmt::format("<text x='{}' y='{:.1f}' text-anchor='end'>{:.2f}</text>", kLeft - 6, y + 4, top * (4 - i) / 4);
  }
  svg += fmt::format("<text x='{}' y='{}'>0 s</text><text x='{}' y='{}' text-anchor='end'>{:.1f} s</text>", kLeft,
                     kHeight - 8, kWidth - 10, kHeight - 8, end_s);
  svg += fmt::format("<text x='14' y='{}' transform='rotate(-90 14 {})'>{}</text>", kHeight / 2, kHeight / 2, unit);
  return svg + lines + "'/></svg>";
}

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:1000px;margin:2rem auto;padding:0 1rem;color:#1c2024;"
    "background:#fff}h1{margin-bottom:0}table{border-collapse:collapse;margin:1rem 0}td,th{padding:.25rem 1rem .25rem "
    "0;text-align:left;border-bottom:1px solid #dde}td.n{text-align:right;font-variant-numeric:tabular-nums}"
    "img,video{max-width:100%;background:#000}svg{max-width:100%}svg text{font:11px sans-serif;fill:#445}"
    "polyline{fill:none;stroke:#b3261e;stroke-width:1.4}.grid{stroke:#dde}.verdict{padding:.1rem .6rem;border-radius:"
    "4px;color:#fff}.pass{background:#2e7d32}.marginal{background:#b26a00}.fail{background:#b3261e}"
    "figcaption{color:#556;font-size:.9rem}figure{margin:1.5rem 0}";

}  // namespace

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

Result<void> write_demo_report(const std::filesystem::path& folder, const DemoFigures& f) {
  const std::vector<double> px = column(f.errors, &FrameError::overlay_px);
  const std::vector<double> mm = column(f.errors, &FrameError::target_mm);
  const nlohmann::json json = {
      {"verdict", f.verdict},
      {"reasons", f.reasons},
      {"overlay_error_px_p50", percentile(px, 0.50)},
      {"overlay_error_px_p95", percentile(px, 0.95)},
      {"overlay_error_px_max", percentile(px, 1)},
      {"target_error_mm_p50", percentile(mm, 0.50)},
      {"target_error_mm_p95", percentile(mm, 0.95)},
      {"target_error_mm_max", percentile(mm, 1)},
      {"fre_mm", f.fre_mm},
      {"fiducial_residuals_mm", f.fiducial_residuals_mm},
      {"camera_rms_px", f.camera_rms_px},
      {"hand_eye_rms_px", f.hand_eye_rms_px},
      {"board_views", f.board_views},
      {"tracker_rate_hz", f.tracker_rate_hz},
      {"position_noise_mm", f.position_noise_mm},
      {"angle_noise_deg", f.angle_noise_deg},
      {"frames", f.frames},
      {"frames_dropped", f.frames_dropped},
      {"frames_without_overlay", f.frames_without_overlay},
      {"wall_s", f.wall_s},
  };

  std::string rows;
  const auto row = [&rows](const std::string& name, const std::string& value) {
    rows += fmt::format("<tr><th>{}</th><td class='n'>{}</td></tr>\n", name, value);
  };
  row("tumour centre, 3-D error, median / p95 / worst",
      fmt::format("{:.2f} / {:.2f} / {:.2f} mm", percentile(mm, 0.5), percentile(mm, 0.95), percentile(mm, 1)));
  row("tumour centre, in the picture, median / p95 / worst",
      fmt::format("{:.1f} / {:.1f} / {:.1f} px", percentile(px, 0.5), percentile(px, 0.95), percentile(px, 1)));
  row("fiducial registration error (RMS)", fmt::format("{:.2f} mm", f.fre_mm));
  row("residual per fiducial", fmt::format("{:.2f} mm", fmt::join(f.fiducial_residuals_mm, ", ")));
  row("camera calibration (RMS)", fmt::format("{:.2f} px, {} views", f.camera_rms_px, f.board_views));
  row("tracked reprojection after hand-eye (RMS)", fmt::format("{:.2f} px", f.hand_eye_rms_px));
  row("tracker rate", fmt::format("{:.1f} Hz", f.tracker_rate_hz));
  row("tracker noise, each axis", fmt::format("{} mm, {} deg", f.position_noise_mm, f.angle_noise_deg));
  row("frames / dropped / without overlay",
      fmt::format("{} / {} / {}", f.frames, f.frames_dropped, f.frames_without_overlay));
  row("wall time", fmt::format("{:.1f} s", f.wall_s));

  std::string reasons;
  for (const std::string& reason : f.reasons) reasons += "<li>" + reason + "</li>";

  const std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title><style>{1}</style></head><body>\n"
      "<h1>{0}</h1>\n<p>Verdict: <span class='verdict {2}'>{2}</span></p>\n<ul>{3}</ul>\n"
      "<figure><img src='overlay.png' alt='Six overlaid frames'><figcaption>The CT's vessels and tumour over the "
      "video. "
      "The cross is where the tumour's centre truly is, the circle where the overlay puts it.</figcaption></figure>\n"
      "<figure><img src='video.png' alt='The same frames without overlay'><figcaption>The same frames as the camera "
      "saw "
      "them.</figcaption></figure>\n<figure><video src='overlay.mp4' controls loop muted></video></figure>\n"
      "<h2>Figures</h2>\n<table>{4}</table>\n<h2>Error of the tumour's centre over time</h2>\n{5}\n{6}\n"
      "<p>All sensors are simulated; the truth they are compared with never reaches the program under test.</p>\n"
      "</body></html>\n",
      f.title, kStyle, f.verdict, reasons, rows, plot(f.errors, &FrameError::target_mm, "mm"),
      plot(f.errors, &FrameError::overlay_px, "px"));
  return write_files({{folder / "report.json", text_of(json)}, {folder / "report.html", html}});
}

}  // namespace birdseye::host
