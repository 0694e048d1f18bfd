#include "host/registration/geometry/geometry_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/expected_errors.hpp"
#include "host/registration/geometry/gathered_points.hpp"
#include "host/registration/geometry/hypotheses.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/geometry/stereo.hpp"
#include "host/registration/views/rendered_views.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

namespace {

constexpr double kDistanceSpacing_mm = 2, kMargin_mm = 24;
constexpr double kRenderSpacing_mm = 3;

Error called_off() {
  return {Errc::disconnected, "the registration was called off; nothing of it is kept"};
}

DisplacementField no_deformation(const Volume& ct, const SignedDistance& organ) {
  return field_over(ct, LatticeField(organ));
}

/// The median of how far a view's outline is from the surface; none where it shows too little of one.
std::optional<double> outline_off_mm(const PinholeView& view, const SeenSurface& surface) {
  constexpr double kFarthest_mm = 12;
  constexpr std::size_t kFewest = 12;
  std::vector<double> off_mm;
  for (const SeenPoint& point : outline_points({view}, surface, kFarthest_mm))
    off_mm.push_back(std::abs(surface.distance().distance_mm(point.place_mm)));
  if (off_mm.size() < kFewest) return std::nullopt;
  return median_of(std::move(off_mm));
}

}  // namespace

Result<ViewRegistration> register_geometry(const std::vector<VideoView>& views, std::span<const RgbView> pictures,
                                           const Volume& ct, const Volume* labels, std::span<const int> label_values,
                                           const TransferFunction& transfer, const GeometrySettings& settings) {
  if (views.empty()) return Error{Errc::bad_value, "no views to register to"};
  if (pictures.size() != views.size())
    return Error{Errc::bad_value, fmt::format("{} pictures for {} views", pictures.size(), views.size())};
  for (std::size_t n = 0; n < views.size(); ++n) {
    const CameraModel& camera = views[n].camera;
    if (!pictures[n].whole() || pictures[n].width_px != camera.width_px || pictures[n].height_px != camera.height_px ||
        views[n].mask.size() != pictures[n].area_px()) {
      return Error{Errc::bad_value, fmt::format("{}: its picture or mask is not of the camera's {}x{} pixels",
                                                views[n].name, camera.width_px, camera.height_px)};
    }
  }
  const auto organ =
      signed_distance_of(ct, tissue_voxels(ct, labels, label_values, transfer), kDistanceSpacing_mm, kMargin_mm);
  if (!organ) return organ.error();
  const auto tissue = tissue_of(ct, labels, label_values, transfer, kRenderSpacing_mm);
  if (!tissue) return tissue.error();
  auto rendered = RenderedViews::make(views, *tissue, "mi");
  if (!rendered) return rendered.error();
  ViewRegistration out;
  out.why_so_many_points = "as the evidence weighs the hypotheses";
  out.similarity_before = rendered->similarity(no_deformation(ct, *organ));
  out.per_view_before = rendered->per_view();
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (rendered->tissue_pixels(n) > 0) continue;
    return Error{Errc::not_found,
                 fmt::format("{}: sees nothing of the organ; check its pose and the labels", views[n].name)};
  }
  std::vector<PinholeView> seen_by;
  for (std::size_t n = 0; n < views.size(); ++n) seen_by.push_back(pinhole_view(views[n], pictures[n]));

  // Each round looks nearer to the surface as the round before left it.
  struct Round {
    double grid_px, span_mm, step_mm, outline_mm;
  };
  constexpr std::array kRounds{Round{18, 12, 0.5, 0}, Round{18, 8, 0.4, 9}, Round{18, 6, 0.3, 8},
                               Round{12, 4, 0.25, 5}};
  std::vector<DisplacementPrior> hypotheses = hypotheses_of(ct, ElasticModes::of(*organ), settings.control_points);
  BelievedDeformation found(*organ);
  for (const Round& round : kRounds) {
    if (settings.watch.cancelled()) return called_off();
    const SeenSurface surface(seen_distance(*organ, found.mean));
    const std::vector<SeenPoint> by_stereo =
        stereo_points(seen_by, surface, {round.grid_px, round.span_mm, round.step_mm});
    out.stereo_points = by_stereo.size();
    if (settings.watch.cancelled()) return called_off();
    std::vector<SeenPoint> by_outlines;
    if (round.outline_mm > 0) by_outlines = outline_points(seen_by, surface, round.outline_mm);
    std::vector<SeenPoint> points = gathered_points(by_stereo, surface);
    const std::vector<SeenPoint> of_outlines = gathered_points(by_outlines, surface);
    points.insert(points.end(), of_outlines.begin(), of_outlines.end());
    if (points.empty() && (round.outline_mm == 0 || !found.fits.empty())) continue;  // other rounds may say more
    if (points.empty()) {
      return Error{Errc::not_found,
                   "no place of the surface is found in two views or as an outline: check that pictures, poses and CT "
                   "belong together, or give views nearer to one another"};
    }
    auto believed = believe(*organ, points, hypotheses, found, settings.watch);
    if (!believed) return called_off();
    found = *std::move(believed);
    ++out.evaluations;
    settings.progress(fmt::format("round {} of {}: {} places by stereo, {} by outlines; most believed: {}",
                                  out.evaluations, kRounds.size(), *out.stereo_points, by_outlines.size(),
                                  found.fits.front().prior().name));
  }
  if (settings.watch.cancelled()) return called_off();
  out.field = field_over(ct, found.mean);
  out.min_jacobian = least_determinant(out.field);
  out.folded = out.min_jacobian <= 0;
  if (out.folded) {
    out.worse_than_start = true;
    out.field = no_deformation(ct, *organ);
    out.min_jacobian = 1;
  }
  const SeenSurface surface(seen_distance(*organ, found.mean));
  for (const PinholeView& view : seen_by) out.outline_off_mm.push_back(outline_off_mm(view, surface));
  out.similarity_after = rendered->similarity(out.field);
  out.per_view_after = rendered->per_view();
  if (settings.estimate_uncertainty && !out.folded) {
    out.expected = expected_errors(*organ, found, seen_by, settings.targets_at_rest_mm);
    if (out.expected->surface) out.uncertainty_mm = out.expected->surface->rms_mm;
  }
  return out;
}

}  // namespace birdseye::host
