#include "host/registration/views/rendered_views.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace birdseye::host {

namespace {

/// Depth as HU: tissue begins where it is 0. All of a tissue's depths on this grid are HU that there are.
constexpr double kHuPerMm = 190, kBoundaryHu = 1000;
constexpr double kEmptyHu = kBoundaryHu - 50, kOpaqueHu = kBoundaryHu + 50;
constexpr double kExtinctionPerMm = 4;
/// Of a shell, mm: several mean free paths of the light.
constexpr double kShell_mm = 6;

TransferFunction opaque() {
  const Eigen::Vector3d white = Eigen::Vector3d::Ones();
  return TransferFunction({{kEmptyHu, white, 0}, {kOpaqueHu, white, kExtinctionPerMm}});
}

/// The lamp is at the lens. What is lit from the side keeps some light, to be told from the empty background.
RenderSettings lit_from_the_lens() {
  RenderSettings settings;
  settings.step_mm = 1.4;
  settings.ambient = 0.15;
  settings.diffuse = 0.85;
  settings.specular = 0;
  return settings;
}

std::unique_ptr<Volume> shell_of(const Tissue& tissue) {
  auto shell = std::make_unique<Volume>();
  shell->size = tissue.points;
  shell->spacing_mm = tissue.spacing_mm;
  shell->patient_from_voxel = tissue.patient_from_grid;
  shell->patient_from_voxel.scale(tissue.spacing_mm);
  shell->hu.resize(tissue.depth_mm.size());
  for (std::size_t v = 0; v < shell->hu.size(); ++v) {
    const auto depth_mm = static_cast<double>(tissue.depth_mm[v]);
    const double hu = depth_mm > kShell_mm ? 0 : kBoundaryHu + kHuPerMm * depth_mm;
    shell->hu[v] = static_cast<std::int16_t>(std::lround(hu));
  }
  return shell;
}

}  // namespace

Result<RenderedViews> RenderedViews::make(const std::vector<VideoView>& views, const Tissue& tissue,
                                          const std::string& similarity) {
  RenderedViews made;
  made.shell_ = shell_of(tissue);
  made.caster_ = std::make_unique<RayCaster>(*made.shell_, opaque());
  for (const VideoView& view : views) {
    auto measure = make_similarity(similarity, {view.camera.width_px, view.camera.height_px, view.grey, view.mask});
    if (!measure) return measure.error().with_context(view.name);
    const auto same = std::find_if(made.views_.begin(), made.views_.end(),
                                   [&](const View& other) { return other.rays->camera() == view.camera; });
    auto rays = same != made.views_.end() ? same->rays : std::make_shared<const LensRays>(view.camera);
    made.views_.push_back({std::move(rays), view.camera_from_patient, view.mask, *std::move(measure)});
  }
  made.per_view_.resize(views.size());
  made.tissue_pixels_.resize(views.size());
  return made;
}

double RenderedViews::similarity(const DisplacementField& field) {
  caster_->deform(field);
  const RenderSettings settings = lit_from_the_lens();
  for (std::size_t n = 0; n < views_.size(); ++n) {
    const View& view = views_[n];
    const ImageRgba picture = caster_->render(*view.rays, view.camera_from_patient, settings);
    grey_.resize(view.mask.size());
    std::size_t seen = 0;
    for (std::size_t i = 0; i < grey_.size(); ++i) {
      grey_[i] = picture.rgba[4 * i];  // all tissue is white
      seen += view.mask[i] != 0 && picture.rgba[4 * i + 3] != 0 ? 1U : 0U;
    }
    tissue_pixels_[n] = seen;
    per_view_[n] = view.measure->value(grey_);
  }
  return std::accumulate(per_view_.begin(), per_view_.end(), 0.0) / static_cast<double>(views_.size());
}

}  // namespace birdseye::host
