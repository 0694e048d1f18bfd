#include "host/registration/geometry/held_out_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/base/median.hpp"
#include "host/registration/geometry/gathered_points.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/geometry/sight.hpp"
#include "host/registration/geometry/stereo.hpp"

namespace birdseye::host {

namespace {

constexpr StereoSettings kSweep{18, 4, 0.3};
constexpr double kOutline_mm = 6;

/// The view of which two others or more see most places.
std::size_t most_seen_by_others(const SeenSurface& surface, const std::vector<PinholeView>& views) {
  constexpr int kGrid_px = 24;
  constexpr std::size_t kOthers = 2;
  const Sight sight(surface, views);
  std::size_t best = 0, most = 0;
  for (std::size_t n = 0; n < views.size(); ++n) {
    const PinholeView& view = views[n];
    std::size_t count = 0;
    for (int y = kGrid_px; y < view.height_px; y += kGrid_px) {
      for (int x = kGrid_px; x < view.width_px; x += kGrid_px) {
        const auto depth_mm = static_cast<double>(sight.depths(n).at(x, y));
        if (!std::isfinite(depth_mm)) continue;
        const Eigen::Vector3d place_mm = view.eye_in_patient_mm + depth_mm * view.ray(x, y);
        if (sight.sees(n, place_mm) && sight.seen_by(place_mm) > kOthers) ++count;
      }
    }
    if (count <= most) continue;
    most = count;
    best = n;
  }
  return best;
}

std::vector<SeenPoint> places_of(const std::vector<PinholeView>& by_stereo, const std::vector<PinholeView>& by_outline,
                                 const SeenSurface& surface) {
  std::vector<SeenPoint> out = gathered_points(stereo_points(by_stereo, surface, kSweep), surface);
  const std::vector<SeenPoint> outline = gathered_points(outline_points(by_outline, surface, kOutline_mm), surface);
  out.insert(out.end(), outline.begin(), outline.end());
  return out;
}

const PinholeView& nearest_of(const std::vector<PinholeView>& views, const PinholeView& to) {
  return *std::min_element(views.begin(), views.end(), [&](const PinholeView& a, const PinholeView& b) {
    return (a.eye_in_patient_mm - to.eye_in_patient_mm).squaredNorm() <
           (b.eye_in_patient_mm - to.eye_in_patient_mm).squaredNorm();
  });
}

}  // namespace

std::optional<HeldOutView> held_out_view(const SignedDistance& organ, const std::vector<PinholeView>& views,
                                         const BelievedDeformation& found, std::span<const SeenPoint> touches,
                                         std::span<const MatchedPoint> matched) {
  constexpr std::size_t kFewestViews = 3, kFewestPlaces = 12;
  constexpr std::array kGoOn_mm{1.0, 0.6, 0.5};
  if (views.size() < kFewestViews || found.fits.empty()) return std::nullopt;
  const SeenSurface surface(seen_distance(organ, found.mean));
  const std::size_t left_out = most_seen_by_others(surface, views);
  std::vector<PinholeView> kept = views;
  kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(left_out));
  std::vector<SeenPoint> points = places_of(kept, kept, surface);
  points.insert(points.end(), touches.begin(), touches.end());
  if (points.size() < kFewestPlaces) return std::nullopt;
  const DisplacementFit& best = found.fits.front();
  const DisplacementFit fit = DisplacementFit::solve(organ, points, best.prior(), &best, kGoOn_mm, matched);
  if (!std::isfinite(fit.log_evidence())) return std::nullopt;
  const LatticeField field = fit.seen_field(organ);
  const SeenSurface without(seen_distance(organ, field));
  const std::vector<SeenPoint> own =
      places_of({views[left_out], nearest_of(kept, views[left_out])}, {views[left_out]}, without);
  if (own.size() < kFewestPlaces) return std::nullopt;
  std::vector<double> off_mm, expected_mm;
  for (const SeenPoint& place : own) {
    off_mm.push_back(std::abs(without.distance().distance_mm(place.place_mm)));
    const Eigen::Vector3d normal = without.normal(place.place_mm);
    const Eigen::Matrix3d covariance = fit.covariance(place.place_mm + field.at(place.place_mm), place.place_mm);
    expected_mm.push_back(std::hypot(place.sigma_mm, kShared_mm, std::sqrt(normal.dot(covariance * normal))));
  }
  constexpr double kHalfAreBelow = 0.6745;  // of a normal distribution's standard deviation
  return HeldOutView{left_out, own.size(), median_of(std::move(off_mm)),
                     kHalfAreBelow * median_of(std::move(expected_mm))};
}

}  // namespace birdseye::host
