#include "host/case/fiducial_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/report/bar_chart.hpp"
#include "host/report/line_plot.hpp"
#include "host/report/place_views.hpp"
#include "host/report/slice_picture.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

bool is_odd(const FiducialsFound& found, std::size_t fiducial) {
  return std::ranges::any_of(found.odd.named, [&](const auto& odd) { return odd.index == fiducial; });
}

void add_table(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  std::vector<std::vector<std::string>> rows{{"fiducial", "CT marker", "residual, mm", "left out, mm", ""}};
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    const auto odd = std::ranges::find_if(found.odd.named, [&](const auto& one) { return one.index == i; });
    rows.push_back({std::to_string(i + 1), std::to_string(input.ct_of_touch.empty() ? i + 1 : input.ct_of_touch[i] + 1),
                    fmt::format("{:.3f}", found.fit.residuals_mm[i]),
                    found.fit.leave_one_out_mm.empty() ? "" : fmt::format("{:.3f}", found.fit.leave_one_out_mm[i]),
                    odd == found.odd.named.end() ? "" : "outlier: " + odd->reason});
  }
  page.table(rows);
  page.paragraph(fmt::format("FRE {:.3f} mm rms; a marker is found and touched to {:.2f} mm rms{}.",
                             found.fit.fre_rms_mm, found.localisation.rms_mm,
                             found.localisation.degrees_of_freedom > 0
                                 ? fmt::format(" (95 % sure: under {:.2f} mm)", found.localisation.upper95_mm)
                                 : std::string()));
}

/// Markers, targets, and from each marker towards where it was touched.
void add_places(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  PlaceViews views{{"x, to the left, mm", "y, to the back, mm", "z, to the head, mm"}, {}};
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    const Vector3d touched_mm = found.fit.to_from * input.touched_mm[i];
    views.marks.push_back({input.ct_mm[i], touched_mm - input.ct_mm[i], is_odd(found, i) ? kRed : kBlue,
                           PlaceShape::ring, std::to_string(i + 1)});
  }
  for (std::size_t i = 0; i < input.targets_mm.size(); ++i)
    views.marks.push_back(
        {input.targets_mm[i], Vector3d::Zero(), kOrange, PlaceShape::cross, fmt::format("target {}", i + 1)});
  const double times = arrow_times(views.marks);
  page.heading("Where the markers are");
  page.svg(
      place_views_svg(views, times),
      fmt::format("From each marker (ring) an arrow towards where it was touched, drawn {:g} times as long. Markers "
                  "all round a target (cross) keep its error small; markers on one side or line do not. Red: said "
                  "to be wrong. Patient frame.",
                  times));
}

void add_residuals(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    const bool odd = is_odd(found, i);
    bars.push_back({fmt::format("fiducial {}", i + 1), found.fit.residuals_mm[i], odd ? kRed : kBlue});
    if (!found.fit.leave_one_out_mm.empty())
      bars.push_back(
          {fmt::format("{} by all the others", i + 1), found.fit.leave_one_out_mm[i], odd ? kRed : kPaleBlue});
  }
  page.heading("By how much each touch is off");
  page.svg(
      bars_svg(bars, "distance, mm"),
      "Each fiducial's residual and, below it, its distance from where all the other fiducials put it: what a target "
      "in its place would be off by.");
}

/// The CT at each marker.
void add_markers(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  constexpr double kWide_mm = 40;
  constexpr int kSlice_px = 160, kColumns = 2;
  constexpr Colour kMarker{86, 180, 233}, kTouched{240, 228, 66};
  std::vector<Picture> pictures;
  for (std::size_t i = 0; i < input.touched_mm.size(); ++i) {
    const ThreePlanes planes(input.ct_mm[i], kWide_mm, kSlice_px);
    Picture picture = planes.draw(*input.volume, -200, 1500);
    planes.mark(picture, input.ct_mm[i], kMarker);
    planes.mark(picture, found.fit.to_from * input.touched_mm[i], kTouched);
    draw_text(picture, {6, 18}, std::to_string(i + 1), kMarker);
    pictures.push_back(std::move(picture));
  }
  page.heading("The markers in the CT");
  page.picture(
      tile(pictures, kColumns, 1),
      fmt::format("Each marker in an axial, a coronal and a sagittal slice of {:g} mm: the marker as it was given "
                  "(blue) and where it was touched (yellow).",
                  kWide_mm));
}

void add_error(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  page.heading("Error to be expected");
  std::vector<std::vector<std::string>> rows{{"place", "expected, mm rms"}};
  for (std::size_t i = 0; i < found.tre_mm.size(); ++i)
    rows.push_back({fmt::format("target {}", i + 1), fmt::format("{:.2f}", found.tre_mm[i])});
  if (found.range) {
    rows.push_back({"where it is least in the CT", fmt::format("{:.2f}", found.range->least_mm)});
    rows.push_back({"the CT's median", fmt::format("{:.2f}", found.range->median_mm)});
    rows.push_back({"where it is most", fmt::format("{:.2f}", found.range->most_mm)});
  }
  if (rows.size() > 1) page.table(rows);
  page.picture(
      fiducials_map(input, found),
      "Slices through the first target, or through the middle of the markers, with lines of equal error in mm. "
      "Circles: markers, whether in the slice or not.");
}

/// Distances of the touched points from the surface, the least first.
Curve distances_of(const std::string& name, const SurfaceIndex& surface, const std::vector<Vector3d>& touched_mm,
                   const Transform<Patient, Tracker>& pose) {
  std::vector<double> distances_mm(touched_mm.size());
  std::transform(touched_mm.begin(), touched_mm.end(), distances_mm.begin(),
                 [&](const Vector3d& place) { return surface.nearest(pose * place).distance_mm; });
  std::sort(distances_mm.begin(), distances_mm.end());
  Curve curve{name, {}};
  for (std::size_t i = 0; i < distances_mm.size(); ++i)
    curve.points.emplace_back(100 * (static_cast<double>(i) + 0.5) / static_cast<double>(distances_mm.size()),
                              distances_mm[i]);
  return curve;
}

void add_surface(HtmlPage& page, const FiducialInput& input, const FiducialsFound& found) {
  const SurfaceIndex surface(*input.surface);
  page.heading("The surface before and after");
  page.svg(
      plot_svg(
          {{"Touched points off the surface",
            "share of the points, %",
            "distance, mm",
            {distances_of("by the fiducials", surface, input.surface_points_mm, found.fit.to_from),
             distances_of("by the surface too", surface, input.surface_points_mm, found.refinement->surface_pose)}}},
          1, {920, 280}),
      fmt::format("The points in the order of their distances. The refinement was {}.",
                  found.refinement->accepted ? "accepted" : "refused: the fiducials' pose stands"));
}

}  // namespace

HtmlPage fiducials_page(const FiducialInput& input, const FiducialsFound& found, const Verdict& verdict) {
  HtmlPage page("Registration by fiducials");
  page.set_verdict(verdict);
  for (const std::string& note : input.notes) page.paragraph(note);
  add_table(page, input, found);
  add_places(page, input, found);
  add_residuals(page, input, found);
  if (input.volume) add_markers(page, input, found);
  add_error(page, input, found);
  if (found.refinement && input.surface) add_surface(page, input, found);
  return page;
}

}  // namespace birdseye::host
