#include "host/registration/geometry/expected_errors.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kPlaces = 120;  ///< of a kind

/// Places at rest of each kind.
struct Places {
  std::vector<Eigen::Vector3d> surface, seen, hidden, inside;
};

/// Whether a view sees a place of the surface.
class Sight {
 public:
  Sight(const SignedDistance& organ, const LatticeField& seen, std::span<const PinholeView> views)
      : surface_(seen_distance(organ, seen)), views_(views) {
    constexpr int kStep_px = 4;
    for (const PinholeView& view : views) depths_.push_back(depth_map(surface_, view, kStep_px));
  }
  [[nodiscard]] bool sees(const Eigen::Vector3d& place_mm) const {
    constexpr double kLeastFacing = 0.1, kBehind_mm = 4;
    const Eigen::Vector3d normal = surface_.normal(place_mm);
    for (std::size_t n = 0; n < views_.size(); ++n) {
      const PinholeView& view = views_[n];
      const auto pixel = view.project(place_mm);
      if (!(pixel.depth_mm > 0) || pixel.x_px < 0 || pixel.y_px < 0 || pixel.x_px > view.width_px - 1 ||
          pixel.y_px > view.height_px - 1)
        continue;
      if ((view.eye_in_patient_mm - place_mm).normalized().dot(normal) < kLeastFacing) continue;
      const double depth_mm = static_cast<double>(depths_[n].at(pixel.x_px, pixel.y_px));
      if (std::isfinite(depth_mm) && depth_mm > pixel.depth_mm - kBehind_mm) return true;
    }
    return false;
  }

 private:
  SeenSurface surface_;
  std::span<const PinholeView> views_;
  std::vector<DepthMap> depths_;
};

void thin_out(std::vector<Eigen::Vector3d>& places) {
  const std::size_t every = std::max<std::size_t>(1, places.size() / kPlaces);
  for (std::size_t i = 0; i * every < places.size(); ++i) places[i] = places[i * every];
  places.resize((places.size() + every - 1) / every);
}

Places places_of(const SignedDistance& organ, const LatticeField& seen, std::span<const PinholeView> views) {
  constexpr double kInside_mm = 6;
  const Sight sight(organ, seen, views);
  Places out;
  for (int k = 0; k < organ.points()[2]; ++k) {
    for (int j = 0; j < organ.points()[1]; ++j) {
      for (int i = 0; i < organ.points()[0]; ++i) {
        const Eigen::Vector3d place = organ.patient_from_box() * (organ.spacing_mm() * Eigen::Vector3d(i, j, k));
        const auto at = organ.sample(place);
        if (std::abs(at.distance_mm) < 0.5 * organ.spacing_mm())
          out.surface.push_back(place - at.distance_mm * at.gradient);
        if (at.distance_mm < -kInside_mm) out.inside.push_back(place);
      }
    }
  }
  for (const Eigen::Vector3d& place : out.surface)
    (sight.sees(seen_place(seen, place)) ? out.seen : out.hidden).push_back(place);
  for (auto* const places : {&out.surface, &out.seen, &out.hidden, &out.inside}) thin_out(*places);
  return out;
}

/// Of the mean covariance over places; none where there are none.
std::optional<ExpectedError> over(std::span<const Eigen::Vector3d> places, const BelievedDeformation& found) {
  if (places.empty()) return std::nullopt;
  std::vector<Eigen::Matrix3d> each(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) { each[i] = found.covariance(places[i]); });
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Matrix3d& covariance : each) sum += covariance;
  return expected_error(sum / static_cast<double>(places.size()));
}

}  // namespace

ExpectedError expected_error(const Eigen::Matrix3d& covariance_mm2) {
  const double mean = covariance_mm2.trace(), squares = (covariance_mm2 * covariance_mm2).trace();
  if (!(mean > 0)) return {0, 0};
  constexpr double kQuantile95 = 1.6448536269514722;  // of the normal distribution
  const double freedom = mean * mean / squares, a = 2 / (9 * freedom);
  return {std::sqrt(mean), std::sqrt(mean * std::pow(1 - a + kQuantile95 * std::sqrt(a), 3))};
}

ExpectedErrors expected_errors(const SignedDistance& organ, const BelievedDeformation& found,
                               std::span<const PinholeView> views,
                               std::span<const Eigen::Vector3d> targets_at_rest_mm) {
  const Places places = places_of(organ, found.mean, views);
  ExpectedErrors out;
  out.surface = over(places.surface, found);
  out.seen = over(places.seen, found);
  out.hidden = over(places.hidden, found);
  out.inside = over(places.inside, found);
  for (const Eigen::Vector3d& target : targets_at_rest_mm)
    out.targets.push_back(expected_error(found.covariance(target)));
  if (places.seen.empty()) return out;
  double sum_mm2 = 0;
  for (const Eigen::Vector3d& place : places.seen) sum_mm2 += (seen_place(found.mean, place) - place).squaredNorm();
  out.seen_moved_mm = std::sqrt(sum_mm2 / static_cast<double>(places.seen.size()));
  return out;
}

}  // namespace birdseye::host
