#include "host/bench/true_places.hpp"

#include <algorithm>
#include <cmath>

#include "host/registration/geometry/pinhole_view.hpp"
#include "host/registration/geometry/seen_surface.hpp"
#include "host/registration/views/tissue.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

Vector3d grid_place(const SignedDistance& organ, int i, int j, int k) {
  return organ.patient_from_box() * (organ.spacing_mm() * Vector3d(i, j, k));
}

/// Calls work with each point of the organ's grid, x fastest.
template <class Work>
void for_grid(const SignedDistance& organ, const Work& work) {
  for (int k = 0; k < organ.points()[2]; ++k) {
    for (int j = 0; j < organ.points()[1]; ++j) {
      for (int i = 0; i < organ.points()[0]; ++i) work(grid_place(organ, i, j, k));
    }
  }
}

/// The organ as it truly lies now.
SeenSurface deformed_surface(const SignedDistance& organ, const DisplacementField& truth) {
  std::vector<float> distances_mm;
  distances_mm.reserve(grid_count(organ.points()));
  for_grid(organ, [&](const Vector3d& place) {
    distances_mm.push_back(static_cast<float>(organ.distance_mm(place + truth.displacement(place))));
  });
  return SeenSurface(SignedDistance(organ.points(), organ.spacing_mm(), organ.patient_from_box(), distances_mm));
}

bool sees(const PinholeView& view, const SeenSurface& surface, const Vector3d& place_mm) {
  constexpr double kLeastFacing = 0.1, kBehind_mm = 3;
  const auto pixel = view.project(place_mm);
  if (!(pixel.depth_mm > 0) || !(pixel.x_px >= 0) || !(pixel.y_px >= 0) || pixel.x_px > view.width_px - 1 ||
      pixel.y_px > view.height_px - 1)
    return false;
  if (view.lens.at<std::uint8_t>(static_cast<int>(std::lround(pixel.y_px)),
                                 static_cast<int>(std::lround(pixel.x_px))) == 0)
    return false;
  if ((view.eye_in_patient_mm - place_mm).normalized().dot(surface.normal(place_mm)) < kLeastFacing) return false;
  const auto met = surface.meet(view.eye_in_patient_mm, view.ray(pixel.x_px, pixel.y_px));
  // A ray that just misses is one that nothing stops.
  return !met || met->distance_mm > 0 || met->depth_mm > pixel.depth_mm - kBehind_mm;
}

std::vector<TruePlace> thinned(const std::vector<Vector3d>& rest_mm, const DisplacementField& truth) {
  constexpr std::size_t kMost = 2000;
  const std::size_t every = (rest_mm.size() + kMost - 1) / kMost;
  std::vector<TruePlace> out;
  for (std::size_t i = 0; i < rest_mm.size(); i += every) out.push_back({rest_mm[i], truth.deformed_of(rest_mm[i])});
  return out;
}

}  // namespace

Result<std::vector<PlacesOfKind>> true_places(const RegistrationCase& c, const TransferFunction& transfer,
                                              const DisplacementField& truth,
                                              std::span<const Transform<Camera, Patient>> true_poses) {
  constexpr double kInside_mm = 6, kMoved_mm = 3;
  const auto organ = organ_distance(c.ct, c.labels ? &*c.labels : nullptr, c.label_values, transfer);
  if (!organ) return organ.error();
  std::vector<Vector3d> of_surface, of_inside;
  for_grid(*organ, [&](const Vector3d& place) {
    const auto at = organ->sample(place);
    if (std::abs(at.distance_mm) < 0.5 * organ->spacing_mm())
      of_surface.push_back(place - at.distance_mm * at.gradient);
    if (at.distance_mm < -kInside_mm) of_inside.push_back(place);
  });
  PlacesOfKind all{"surface", thinned(of_surface, truth)}, by_two{"seen_by_two", {}}, seen{"seen", {}},
      seen_moved{"seen_moved", {}}, hidden{"hidden", {}};
  std::vector<PinholeView> views;
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    VideoView view = c.views[n];
    view.camera_from_patient = true_poses[n];
    views.push_back(pinhole_view(view, c.pictures[n].view()));
  }
  const SeenSurface surface = deformed_surface(*organ, truth);
  for (const TruePlace& place : all.places) {
    const auto by = std::count_if(views.begin(), views.end(),
                                  [&](const PinholeView& view) { return sees(view, surface, place.now_mm); });
    if (by >= 2) by_two.places.push_back(place);
    (by >= 1 ? seen : hidden).places.push_back(place);
    if (by >= 1 && (place.now_mm - place.rest_mm).norm() >= kMoved_mm) seen_moved.places.push_back(place);
  }
  return std::vector<PlacesOfKind>{std::move(all),        std::move(by_two), std::move(seen),
                                   std::move(seen_moved), std::move(hidden), {"inside", thinned(of_inside, truth)}};
}

PlacesError error_of(std::span<const TruePlace> places, const DisplacementField* field) {
  PlacesError error;
  for (const TruePlace& place : places) {
    const Vector3d found = field != nullptr ? field->deformed_of(place.rest_mm) : place.rest_mm;
    const double square_mm2 = (found - place.now_mm).squaredNorm();
    error.mean_mm += std::sqrt(square_mm2);
    error.rms_mm += square_mm2;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, places.size()));
  return {error.mean_mm / count, std::sqrt(error.rms_mm / count)};
}

}  // namespace birdseye::host
