#include "host/case/registration_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/report/html_page.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

std::string trace_svg(const std::vector<TracePoint>& trace) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Panel panel{
      "Similarity at each evaluation, and degrees of freedom", "evaluations", "similarity", {{"similarity", {}}}};
  panel.from_zero = false;
  // A line for each stage: values of different resolutions or numbers of unknowns cannot be compared.
  for (std::size_t i = 0; i < trace.size(); ++i) {
    const auto x = static_cast<double>(i);
    const bool begins =
        i == 0 || trace[i].reduction != trace[i - 1].reduction || trace[i].parameters != trace[i - 1].parameters;
    if (begins) {
      panel.curves[0].points.emplace_back(kNone, kNone);
      panel.marks.push_back({x, std::to_string(trace[i].parameters)});
    }
    panel.curves[0].points.emplace_back(x, trace[i].similarity);
  }
  return plot_svg({panel}, 1, {920, 300});
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

namespace {

/// Whether a pixel of the organ has a neighbour that is not of it.
bool on_outline(const ImageRgba& overlay, int x, int y) {
  const auto is_organ = [&](int i, int j) {
    constexpr std::uint8_t kHalf = 128;
    const auto at =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(overlay.width_px) + static_cast<std::size_t>(i);
    return overlay.rgba[4 * at + 3] >= kHalf;
  };
  if (x == 0 || y == 0 || x + 1 == overlay.width_px || y + 1 == overlay.height_px || !is_organ(x, y)) return false;
  return !is_organ(x - 1, y) || !is_organ(x + 1, y) || !is_organ(x, y - 1) || !is_organ(x, y + 1);
}

void draw_outline(Picture& picture, const ImageRgba& overlay, const std::array<std::uint8_t, 3>& colour, bool dashed) {
  constexpr int kDash_px = 6;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (!on_outline(overlay, x, y) || (dashed && (x + y) / kDash_px % 2 != 0)) continue;
      for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
        const int i = std::min(x + dx, picture.width_px - 1), j = std::min(y + dy, picture.height_px - 1);
        std::copy(colour.begin(), colour.end(), picture.rgb.begin() + std::ptrdiff_t{3} * (j * picture.width_px + i));
      }
    }
  }
}

}  // namespace

Picture outline_picture(const Picture& view, const ImageRgba& before, const ImageRgba& after) {
  Picture out = view;
  draw_outline(out, before, {230, 159, 0}, true);
  draw_outline(out, after, {86, 180, 233}, false);
  return out;
}

namespace {

/// expected_error.png lies beside the page.
void add_expected(HtmlPage& page, const ExpectedErrors& expected) {
  page.heading("Error to be expected");
  page.picture_files(
      {"expected_error.png"},
      "The organ as it was found, from six sides of the patient: the brighter, the less is known of where "
      "a place is. The cross is the target, where one is named; it may lie behind.");
  std::vector<std::vector<std::string>> rows{{"side", "of it known mostly by the prior", "expected there, mm rms"}};
  for (const OpenSide& side : expected.open)
    rows.push_back({side.side, fmt::format("{:.0f} %", 100 * side.share), fmt::format("{:.1f}", side.rms_mm)});
  if (expected.open.empty()) page.paragraph("The views leave no side of the organ open.");
  if (!expected.open.empty()) page.table(rows);
}

/// How a view is explained by what was found, by the figure that the optimiser goes by.
std::string how_it_fits(const ViewRegistration& found, std::size_t view) {
  if (view < found.per_view_before.size())
    return fmt::format(": similarity {:.4f} before, {:.4f} after", found.per_view_before[view],
                       found.per_view_after[view]);
  if (view < found.outline_off_mm.size() && found.outline_off_mm[view])
    return fmt::format(": outline {:.1f} mm off", *found.outline_off_mm[view]);
  return "";
}

}  // namespace

std::string registration_report(const RegistrationCase& c, const ViewRegistration& found, const Verdict& verdict,
                                const nlohmann::json& json) {
  HtmlPage page(fmt::format("Registration to {} views", c.views.size()));
  page.set_verdict(verdict);
  std::vector<std::vector<std::string>> rows{{"figure", ""}};
  for (const auto& [key, value] : json.items()) {
    if (key == "verdict") continue;
    if (value.is_number()) rows.push_back({key, fmt::format("{:.6g}", value.get<double>())});
    if (value.is_string()) rows.push_back({key, value.get<std::string>()});
  }
  page.table(rows);
  for (const std::string& note : c.notes) page.paragraph(note);
  if (found.expected && !found.expected->places.empty()) add_expected(page, *found.expected);
  if (!found.trace.empty()) {
    page.heading("Similarity on the way");
    page.svg(trace_svg(found.trace), "Each line is one stage; lines of different stages cannot be compared.");
  }
  page.heading("Views");
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    std::vector<std::string> files;
    for (const char* kind : {"before", "after", "difference_before", "difference_after"})
      files.push_back(fmt::format("view{}_{}.png", n, kind));
    page.picture_files({fmt::format("view{}_outlines.png", n)},
                       fmt::format("{}: the organ's outline before (orange, dashed) and after (blue). After, it should "
                                   "lie on the edge of the organ that is seen.",
                                   c.views[n].name));
    page.picture_files(files, fmt::format("{}{}. Left: before; right: after. Above: the overlay; below: difference of "
                                          "grey (red: the video is brighter; blue: darker; grey: not compared).",
                                          c.views[n].name, how_it_fits(found, n)));
  }
  return page.html();
}

}  // namespace birdseye::host
