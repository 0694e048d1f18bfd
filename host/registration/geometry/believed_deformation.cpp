#include "host/registration/geometry/believed_deformation.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace birdseye::host {

namespace {

/// The mean of how far points about a place are left off.
Eigen::Vector3d left_off_about_mm(std::span<const LeftOff> points, const Eigen::Vector3d& seen_mm) {
  constexpr double kTogether_mm = 15, kFew = 0.5;
  Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const LeftOff& point : points) {
    const double weight = std::exp(-0.5 * (point.place_mm - seen_mm).squaredNorm() / (kTogether_mm * kTogether_mm));
    sum_mm += weight * point.off_mm;
    weights += weight;
  }
  return sum_mm / (weights + kFew);
}

}  // namespace

Eigen::Matrix3d BelievedDeformation::covariance(const Eigen::Vector3d& rest_mm) const {
  const Eigen::Vector3d seen_mm = seen_place(mean, rest_mm);
  const Eigen::Vector3d left_off_mm = left_off_about_mm(left_off, seen_mm);
  Eigen::Matrix3d out = left_off_mm * left_off_mm.transpose();
  std::vector<Eigen::Vector3d> each;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < fits.size(); ++i) {
    each.push_back(seen_place(fields[i], rest_mm));
    middle += beliefs[i] * each.back();
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    out += beliefs[i] * (fits[i].covariance(rest_mm, seen_mm) + (each[i] - middle) * (each[i] - middle).transpose());
  }
  return out;
}

Eigen::Matrix3d BelievedDeformation::prior_covariance(const Eigen::Vector3d& rest_mm) const {
  const Eigen::Vector3d seen_mm = seen_place(mean, rest_mm);
  Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const DisplacementPrior& prior = fits[i].prior();
    out += beliefs[i] * prior.covariance(prior.of_seen ? seen_mm : rest_mm);
  }
  return out;
}

std::optional<BelievedDeformation> believe(const SignedDistance& organ, std::span<const SeenPoint> points,
                                           std::span<const DisplacementPrior> more, const BelievedDeformation& before,
                                           const RegistrationWatch& watch, std::span<const MatchedPoint> matched) {
  constexpr std::array kAnneal_mm{8.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.5, 1.0, 1.0};
  constexpr std::array kGoOn_mm{4.0, 2.0, 1.0, 0.6, 0.5};
  constexpr std::size_t kMostBelieved = 4;
  constexpr double kHopeless_nats = 30;
  const std::size_t known = before.candidates.size();
  std::vector<std::optional<DisplacementFit>> fits(known + more.size());
  tbb::parallel_for(std::size_t{0}, fits.size(), [&](std::size_t i) {
    if (watch.cancelled()) return;
    const DisplacementFit* const start = i < known ? &before.candidates[i] : nullptr;
    fits[i] = i < known ? DisplacementFit::solve(organ, points, start->prior(), start, kGoOn_mm, matched)
                        : DisplacementFit::solve(organ, points, more[i - known], nullptr, kAnneal_mm, matched);
  });
  if (!std::all_of(fits.begin(), fits.end(), [](const auto& fit) { return fit.has_value(); })) return std::nullopt;
  BelievedDeformation out(organ);
  for (std::optional<DisplacementFit>& fit : fits) out.candidates.push_back(*std::move(fit));
  std::erase_if(out.candidates, [](const DisplacementFit& fit) { return !std::isfinite(fit.log_evidence()); });
  if (out.candidates.empty()) return std::nullopt;
  std::stable_sort(
      out.candidates.begin(), out.candidates.end(),
      [](const DisplacementFit& a, const DisplacementFit& b) { return a.log_evidence() > b.log_evidence(); });
  const double most = out.candidates.front().log_evidence();
  std::erase_if(out.candidates, [&](const DisplacementFit& fit) { return fit.log_evidence() < most - kHopeless_nats; });
  double sum = 0;
  for (std::size_t i = 0; i < std::min(out.candidates.size(), kMostBelieved); ++i) {
    const DisplacementFit& fit = out.candidates[i];
    out.beliefs.push_back(std::exp((fit.log_evidence() - most) / kEvidenceTemper));
    out.fits.push_back(fit);
    out.fields.push_back(fit.seen_field(organ));
    sum += out.beliefs.back();
  }
  for (double& belief : out.beliefs) belief /= sum;
  for (std::size_t n = 0; n < out.mean.size(); ++n) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < out.fields.size(); ++i) u += out.beliefs[i] * out.fields[i].displacement_mm(n);
    out.mean.set(n, u);
  }
  constexpr double kMost_mm = 8;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double wrong = 0;
    for (std::size_t n = 0; n < out.fits.size(); ++n) wrong += out.beliefs[n] * (1 - out.fits[n].weights()[i]);
    const auto at = organ.sample(points[i].place_mm + out.mean.at(points[i].place_mm));
    out.left_off.push_back({points[i].place_mm, wrong * std::clamp(at.distance_mm, -kMost_mm, kMost_mm) * at.gradient});
  }
  return out;
}

std::optional<Eigen::Vector3d> pushed_place_mm(const SignedDistance& organ, std::span<const SeenPoint> points,
                                               const LatticeField& seen) {
  constexpr double kOff_mm = 0.5, kMost_mm = 3, kTogether_mm = 15;
  constexpr double kFewest_mm = 4;  ///< of all that lie together
  std::vector<Eigen::Vector3d> places_mm;
  std::vector<double> off_mm;
  for (const SeenPoint& point : points) {
    const Eigen::Vector3d rest_mm = point.place_mm + seen.at(point.place_mm);
    const double distance_mm = organ.distance_mm(rest_mm);
    if (std::abs(distance_mm) < kOff_mm) continue;
    places_mm.push_back(rest_mm);
    off_mm.push_back(std::clamp(distance_mm, -kMost_mm, kMost_mm));
  }
  double most_mm = kFewest_mm;
  std::optional<Eigen::Vector3d> out;
  for (const Eigen::Vector3d& place_mm : places_mm) {
    double sum_mm = 0;
    for (std::size_t n = 0; n < places_mm.size(); ++n) {
      sum_mm += off_mm[n] * std::exp(-0.5 * (places_mm[n] - place_mm).squaredNorm() / (kTogether_mm * kTogether_mm));
    }
    if (std::abs(sum_mm) <= most_mm) continue;
    most_mm = std::abs(sum_mm);
    out = place_mm;
  }
  return out;
}

}  // namespace birdseye::host
