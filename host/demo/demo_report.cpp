#include "host/demo/demo_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/files/write_files.hpp"
#include "host/report/html_page.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

std::vector<double> column(const std::vector<FrameError>& errors, double FrameError::*field) {
  std::vector<double> out;
  out.reserve(errors.size());
  for (const FrameError& e : errors) out.push_back(e.*field);
  return out;
}

/// An error over time: a line for each run of frames, for where the overlay was hidden there is nothing to draw.
Panel over_time(const std::vector<FrameError>& errors, double FrameError::*field, const char* title,
                const char* label) {
  constexpr double kGap_s = 0.2, kNone = std::numeric_limits<double>::quiet_NaN();
  Curve curve{"error", {}};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (i > 0 && errors[i].time_s - errors[i - 1].time_s > kGap_s) curve.points.emplace_back(kNone, kNone);
    curve.points.emplace_back(errors[i].time_s, errors[i].*field);
  }
  return {title, "s since the first overlaid frame", label, {curve}};
}

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
      {"verdict", name_of(f.verdict.grade)},
      {"reasons", f.verdict.reasons},
      {"overlay_error_px_p50", percentile(px, 0.50)},
      {"overlay_error_px_p95", percentile(px, 0.95)},
      {"overlay_error_px_max", percentile(px, 1)},
      {"target_error_mm_p50", percentile(mm, 0.50)},
      {"target_error_mm_p95", percentile(mm, 0.95)},
      {"target_error_mm_max", percentile(mm, 1)},
      {"fre_mm", f.fre_mm},
      {"fiducial_residuals_mm", f.fiducial_residuals_mm},
      {"camera_rms_px", f.camera_rms_px},
      {"held_out_px", f.held_out_px},
      {"board_views", f.board_views},
      {"tracker_rate_hz", f.tracker_rate_hz},
      {"position_noise_mm", f.position_noise_mm},
      {"angle_noise_deg", f.angle_noise_deg},
      {"frames", f.frames},
      {"frames_dropped", f.frames_dropped},
      {"frames_without_overlay", f.frames_without_overlay},
      {"board_frames_left_out", f.board_frames_left_out},
      {"other_messages_dropped", f.drops.others},
      {"wall_s", f.wall_s},
  };

  std::vector<std::vector<std::string>> rows{{"figure", ""}};
  const auto row = [&rows](const std::string& name, const std::string& value) { rows.push_back({name, value}); };
  row("tumour centre, 3-D error, median / p95 / worst",
      fmt::format("{:.2f} / {:.2f} / {:.2f} mm", percentile(mm, 0.5), percentile(mm, 0.95), percentile(mm, 1)));
  row("tumour centre, in the picture, median / p95 / worst",
      fmt::format("{:.1f} / {:.1f} / {:.1f} px", percentile(px, 0.5), percentile(px, 0.95), percentile(px, 1)));
  row("fiducial registration error (RMS)", fmt::format("{:.2f} mm", f.fre_mm));
  row("residual per fiducial", fmt::format("{:.2f} mm", fmt::join(f.fiducial_residuals_mm, ", ")));
  row("camera calibration (RMS)", fmt::format("{:.2f} px, {} views", f.camera_rms_px, f.board_views));
  row("hand-eye, held out (RMS)", fmt::format("{:.2f} px", f.held_out_px));
  row("tracker rate", fmt::format("{:.1f} Hz", f.tracker_rate_hz));
  row("tracker noise, each axis", fmt::format("{} mm, {} deg", f.position_noise_mm, f.angle_noise_deg));
  row("frames / dropped / without overlay",
      fmt::format("{} / {} / {}", f.frames, f.frames_dropped, f.frames_without_overlay));
  row("frames of the board without poses / other messages dropped",
      fmt::format("{} / {}", f.board_frames_left_out, f.drops.others));
  row("wall time", fmt::format("{:.1f} s", f.wall_s));

  HtmlPage page(f.title);
  page.set_verdict(f.verdict);
  page.picture_files({"overlay.png"},
                     "The CT's vessels and tumour over the video. The cross is where the tumour's centre truly is, the "
                     "circle where the overlay puts it.");
  page.picture_files({"video.png"}, "The same frames as the camera saw them.");
  page.film_file("overlay.mp4", "All of it.");
  page.heading("Figures");
  page.table(rows);
  page.heading("Error of the tumour's centre");
  if (f.errors.empty()) {
    page.paragraph("No frame carried an overlay.");
  } else {
    page.svg(plot_svg({over_time(f.errors, &FrameError::target_mm, "In the patient", "mm"),
                       over_time(f.errors, &FrameError::overlay_px, "In the picture", "px")},
                      1, {920, 260}),
             "Where the line breaks, frames carried no overlay.");
  }
  page.paragraph("All sensors are simulated; the truth they are compared with never reaches the program under test.");
  return write_files({{folder / "report.json", text_of(json)}, {folder / "report.html", page.html()}});
}

}  // namespace birdseye::host
