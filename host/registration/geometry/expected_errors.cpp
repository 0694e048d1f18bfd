#include "host/registration/geometry/expected_errors.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/registration/geometry/open_sides.hpp"
#include "host/registration/geometry/sight.hpp"

namespace birdseye::host {

namespace {

void thin_out(std::vector<Eigen::Vector3d>& places, std::size_t most) {
  const std::size_t every = std::max<std::size_t>(1, (places.size() + most - 1) / most);
  for (std::size_t i = 0; i * every < places.size(); ++i) places[i] = places[i * every];
  places.resize((places.size() + every - 1) / every);
}

/// Spread over the organ, at rest.
struct Places {
  std::vector<Eigen::Vector3d> surface, inside;
};

Places places_of(const SignedDistance& organ) {
  constexpr double kInside_mm = 6;
  constexpr std::size_t kOfSurface = 400, kOfInside = 120;
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
  thin_out(out.surface, kOfSurface);
  thin_out(out.inside, kOfInside);
  return out;
}

std::vector<KnownPlace> known_surface(std::span<const Eigen::Vector3d> rest_mm, const SignedDistance& organ,
                                      const BelievedDeformation& found, std::span<const PinholeView> views) {
  const LatticeField& mean = found.mean;
  const SeenSurface surface(seen_distance(organ, mean));
  const Sight sight(surface, views);
  std::vector<KnownPlace> out(rest_mm.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) {
    const Eigen::Vector3d seen_mm = seen_place(mean, rest_mm[i]);
    out[i] = {rest_mm[i],
              seen_mm,
              surface.normal(seen_mm),
              sight.seen_by(seen_mm) > 0,
              found.covariance(rest_mm[i]),
              found.prior_covariance(rest_mm[i])};
  });
  return out;
}

/// Of the mean covariance over places.
class Mean {
 public:
  void add(const Eigen::Matrix3d& covariance, const Eigen::Matrix3d& prior_covariance) {
    sum_ += covariance;
    prior_sum_ += prior_covariance;
    ++count_;
  }
  /// None where there are none.
  [[nodiscard]] std::optional<ExpectedError> expected() const {
    if (count_ == 0) return std::nullopt;
    return expected_error(sum_ / count_, prior_sum_ / count_);
  }

 private:
  Eigen::Matrix3d sum_ = Eigen::Matrix3d::Zero(), prior_sum_ = Eigen::Matrix3d::Zero();
  int count_ = 0;
};

Mean inside_of(std::span<const Eigen::Vector3d> rest_mm, const BelievedDeformation& found) {
  std::vector<Eigen::Matrix3d> each(rest_mm.size());
  tbb::parallel_for(std::size_t{0}, each.size(), [&](std::size_t i) { each[i] = found.covariance(rest_mm[i]); });
  Mean out;
  for (std::size_t i = 0; i < each.size(); ++i) out.add(each[i], found.prior_covariance(rest_mm[i]));
  return out;
}

}  // namespace

ExpectedError expected_error(const Eigen::Matrix3d& covariance_mm2, const Eigen::Matrix3d& prior_covariance_mm2) {
  const double mean = covariance_mm2.trace(), squares = (covariance_mm2 * covariance_mm2).trace();
  if (mean == 0) return {0, 0, 0};
  constexpr double kUnknown_mm = std::numeric_limits<double>::infinity();
  if (!(mean > 0) || !std::isfinite(mean)) return {kUnknown_mm, kUnknown_mm, 1};
  constexpr double kQuantile95 = 1.6448536269514722;  // of the normal distribution
  const double freedom = mean * mean / squares, a = 2 / (9 * freedom);
  ExpectedError out{std::sqrt(mean), std::sqrt(mean * std::pow(1 - a + kQuantile95 * std::sqrt(a), 3)), 1};
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> left(covariance_mm2, prior_covariance_mm2,
                                                                       Eigen::EigenvaluesOnly);
  if (const double most = left.eigenvalues().maxCoeff(); most >= 0) out.left_of_prior = std::min(1.0, std::sqrt(most));
  return out;
}

ExpectedErrors expected_errors(const SignedDistance& organ, const BelievedDeformation& found,
                               std::span<const PinholeView> views,
                               std::span<const Eigen::Vector3d> targets_at_rest_mm) {
  const Places places = places_of(organ);
  const std::vector<KnownPlace> surface = known_surface(places.surface, organ, found, views);
  Mean all, seen, hidden;
  double moved_mm2 = 0, count = 0;
  ExpectedErrors out;
  for (const KnownPlace& place : surface) {
    all.add(place.covariance, place.prior_covariance);
    (place.seen ? seen : hidden).add(place.covariance, place.prior_covariance);
    out.places.push_back({place.seen_mm, std::sqrt(place.covariance.trace())});
    if (!place.seen) continue;
    moved_mm2 += (place.seen_mm - place.rest_mm).squaredNorm();
    count += 1;
  }
  out.surface = all.expected();
  out.seen = seen.expected();
  out.hidden = hidden.expected();
  out.inside = inside_of(places.inside, found).expected();
  for (const Eigen::Vector3d& target : targets_at_rest_mm)
    out.targets.push_back(expected_error(found.covariance(target), found.prior_covariance(target)));
  if (count > 0) out.seen_moved_mm = std::sqrt(moved_mm2 / count);
  out.open = open_sides(surface);
  return out;
}

}  // namespace birdseye::host
