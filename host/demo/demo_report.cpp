#include "host/demo/demo_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>

#include "host/files/write_files.hpp"
#include "host/report/html_page.hpp"
#include "host/report/line_plot.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

std::vector<double> column(const std::vector<FrameError>& errors, double FrameError::*field) {
  std::vector<double> out;
  out.reserve(errors.size());
  for (const FrameError& e : errors) out.push_back(e.*field);
  return out;
}

/// A line for each run of frames, for where the overlay was hidden there is nothing to draw.
Curve curve_of(const std::vector<FrameError>& errors, double FrameError::*field, const char* name) {
  constexpr double kGap_s = 0.2, kNone = std::numeric_limits<double>::quiet_NaN();
  Curve curve{name, {}};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (i > 0 && errors[i].time_s - errors[i - 1].time_s > kGap_s) curve.points.emplace_back(kNone, kNone);
    curve.points.emplace_back(errors[i].time_s, errors[i].*field);
  }
  return curve;
}

/// The errors over time, of the CT deformed beside the CT as it was taken where there are both.
std::string errors_svg(const DemoFigures& f) {
  const auto panel = [&f](double FrameError::*field, const char* title, const char* unit) {
    Panel out{title, "s since the first overlaid frame", unit, {}};
    const bool both = f.deforming && f.deforming->found;
    if (both) out.curves.push_back(curve_of(f.deforming->rigid_errors, field, "as it was taken"));
    out.curves.push_back(curve_of(f.errors, field, both ? "deformed" : "error"));
    return out;
  };
  return plot_svg(
      {panel(&FrameError::target_mm, "In the patient", "mm"), panel(&FrameError::overlay_px, "In the picture", "px")},
      1, {920, 260});
}

/// Median, 95th percentile and worst.
std::string spread(const std::vector<double>& values, int digits, const char* unit) {
  return fmt::format("{:.{}f} / {:.{}f} / {:.{}f} {}", percentile(values, 0.5), digits, percentile(values, 0.95),
                     digits, percentile(values, 1), digits, unit);
}

void add_spread(nlohmann::json& json, const std::string& name, const std::vector<double>& values) {
  for (const auto& [suffix, p] : {std::pair{"_p50", 0.5}, {"_p95", 0.95}, {"_max", 1.0}})
    json[name + suffix] = percentile(values, p);
}

/// What matching the CT with the views did to the overlay.
void add_deforming(HtmlPage& page, const DeformingFigures& d, const DemoFigures& f) {
  page.heading("Before and after deforming");
  page.paragraph(fmt::format(
      "Since the CT the liver has moved by up to {:g} mm. The scope was held still at places about it, {} views were "
      "kept, and the CT was matched with them in {:.1f} s: {}.",
      f.deformation_mm, d.views, d.took_s, d.words));
  if (!d.found) return;
  page.table({{"tumour centre, median / p95 / worst", "CT as it was taken", "CT deformed"},
              {"3-D error", spread(column(d.rigid_errors, &FrameError::target_mm), 2, "mm"),
               spread(column(f.errors, &FrameError::target_mm), 2, "mm")},
              {"in the picture", spread(column(d.rigid_errors, &FrameError::overlay_px), 1, "px"),
               spread(column(f.errors, &FrameError::overlay_px), 1, "px")}});
  page.picture_files({"rigid_and_deformed.png"},
                     "The same frames with the CT as it was taken, left, and deformed, right. The cross is where the "
                     "tumour's centre truly is, the circle where the overlay puts it.");
}

}  // namespace

void DemoFigures::note_hidden(const std::string& reason) {
  static const std::regex kNumber("[0-9]+([.][0-9]+)?");
  // Frames before it had shown that at all are frames_unproven, and no part of these.
  if (reason == words("why_video_untold")) {
    ++hidden_because["the video, which had shown that it goes with the scope's poses, had to show it anew"];
    return;
  }
  ++hidden_because[std::regex_replace(reason, kNumber, "...")];
}

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

Result<void> write_demo_report(const std::filesystem::path& folder, const DemoFigures& f) {
  const std::vector<double> px = column(f.errors, &FrameError::overlay_px);
  const std::vector<double> mm = column(f.errors, &FrameError::target_mm);
  nlohmann::json json = {
      {"verdict", name_of(f.verdict.grade)},
      {"reasons", f.verdict.reasons},
      {"deformation_mm", f.deformation_mm},
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
      {"frames_unproven", f.frames_unproven},
      {"frames_without_overlay", f.frames_without_overlay},
      {"board_frames_left_out", f.board_frames_left_out},
      {"other_messages_dropped", f.drops.others},
      {"wall_s", f.wall_s},
  };
  if (!f.notes.empty()) json["notes"] = f.notes;
  if (!f.hidden_because.empty()) json["hidden_because"] = f.hidden_because;
  add_spread(json, "overlay_error_px", px);
  add_spread(json, "target_error_mm", mm);
  if (f.deforming) {
    const DeformingFigures& d = *f.deforming;
    json["views_kept"] = d.views;
    json["deforming_s"] = d.took_s;
    if (d.surface_expected_mm) json["deformed_surface_expected_mm"] = *d.surface_expected_mm;
    if (d.found) {
      add_spread(json, "rigid_overlay_error_px", column(d.rigid_errors, &FrameError::overlay_px));
      add_spread(json, "rigid_target_error_mm", column(d.rigid_errors, &FrameError::target_mm));
    }
  }

  std::vector<std::vector<std::string>> rows{{"figure", ""}};
  const auto row = [&rows](const std::string& name, const std::string& value) { rows.push_back({name, value}); };
  row("tumour centre, 3-D error, median / p95 / worst", spread(mm, 2, "mm"));
  row("tumour centre, in the picture, median / p95 / worst", spread(px, 1, "px"));
  row("fiducial registration error (RMS)", fmt::format("{:.2f} mm", f.fre_mm));
  row("residual per fiducial", fmt::format("{:.2f} mm", fmt::join(f.fiducial_residuals_mm, ", ")));
  row("camera calibration (RMS)", fmt::format("{:.2f} px, {} views", f.camera_rms_px, f.board_views));
  row("hand-eye, held out (RMS)", fmt::format("{:.2f} px", f.held_out_px));
  row("tracker rate", fmt::format("{:.1f} Hz", f.tracker_rate_hz));
  row("tracker noise, each axis", fmt::format("{} mm, {} deg", f.position_noise_mm, f.angle_noise_deg));
  row("frames / dropped / without overlay",
      fmt::format("{} / {} / {}", f.frames, f.frames_dropped, f.frames_without_overlay));
  row("frames before the video had first shown that it goes with the poses", fmt::format("{}", f.frames_unproven));
  row("frames of the board without poses / other messages dropped",
      fmt::format("{} / {}", f.board_frames_left_out, f.drops.others));
  row("wall time", fmt::format("{:.1f} s", f.wall_s));

  HtmlPage page(f.title);
  page.set_verdict(f.verdict);
  if (!f.errors.empty()) {
    page.picture_files({"overlay.png"},
                       "The CT's vessels and tumour over the video. The cross is where the tumour's centre truly is, "
                       "the circle where the overlay puts it.");
    page.picture_files({"video.png"}, "The same frames as the camera saw them.");
  }
  page.film_file("overlay.mp4", "All of it.");
  if (f.deforming) add_deforming(page, *f.deforming, f);
  page.heading("Figures");
  page.table(rows);
  for (const auto& [why, frames] : f.hidden_because)
    page.paragraph(fmt::format("Without an overlay, {} frame{}: {}.", frames, frames == 1 ? "" : "s", why));
  for (const std::string& note : f.notes) page.paragraph(note);
  page.heading("Error of the tumour's centre");
  if (f.errors.empty()) {
    page.paragraph("No frame carried an overlay.");
  } else {
    page.svg(errors_svg(f), "Where the line breaks, frames carried no overlay.");
  }
  page.paragraph("All sensors are simulated; the truth they are compared with never reaches the program under test.");
  return write_files({{folder / "report.json", text_of(json)}, {folder / "report.html", page.html()}});
}

}  // namespace birdseye::host
