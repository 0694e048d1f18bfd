#include "host/registration/geometry/similarity_points.hpp"

#include "host/registration/geometry/organ_surface.hpp"
#include "host/registration/geometry/patch.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

std::vector<SeenPoint> similarity_points(const std::vector<PinholeView>& views, const SignedDistance& organ,
                                         const DisplacementField& field) {
  // Mutual information finds the surface to 1.2 mm across it, and places within 25 mm err together.
  constexpr double kGrid_px = 24, kSigma_mm = 0.4, kBroad_mm = 1.2;
  const SeenSurface surface(deformed_distance(organ, field));
  std::vector<const PinholeView*> all;
  for (const PinholeView& view : views) all.push_back(&view);
  std::vector<SeenPoint> out;
  for (const GridPixel& pixel : patch_grid(views, kGrid_px)) {
    const PinholeView& view = views[pixel.view];
    if (view.usable.at<std::uint8_t>(pixel.y_px, pixel.x_px) == 0) continue;
    const Eigen::Vector3d ray = view.ray(pixel.x_px, pixel.y_px);
    const auto met = surface.meet(view.eye_in_patient_mm, ray);
    if (!met || met->distance_mm != 0) continue;
    const Eigen::Vector3d place_mm = view.eye_in_patient_mm + met->depth_mm * ray;
    if (-surface.normal(place_mm).dot(ray.normalized()) < kPatchFacing) continue;
    out.push_back({place_mm, kSigma_mm, ray.normalized(), 0, kBroad_mm});
    out.back().by_lens_mm = by_lens_errors(place_mm, all);
  }
  return out;
}

}  // namespace birdseye::host
