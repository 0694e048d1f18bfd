#include "calibration/time/edge_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace birdseye {
namespace {

/// Half the width that holds 68.3 % of this posterior is less than its standard deviation, for it has an exponential
/// tail to one side. 0.83 for an exponential alone; this is the ratio for a line's end, which mixes two of them.
constexpr double kHalfWidth = 0.91;
constexpr double kLean = 1.15;

/// Of each slope that is asked for, in a quadrature.
using PerSlope = std::array<double, 65>;

/// The lower convex hull, and the support of lines of a given slope under it; x relative to the points' weighted mean.
class Hull {
 public:
  explicit Hull(std::span<const EdgePoint> points) {
    double sum_x = 0;
    for (const EdgePoint& p : points) {
      sum_x += p.count * p.x_s;
      count_ += p.count;
    }
    mean_x_ = sum_x / count_;
    vertices_.reserve(points.size());
    for (const EdgePoint& p : points) {
      const Vertex next{p.x_s - mean_x_, p.y_ns};
      while (vertices_.size() >= 2 && !turns_up(vertices_[vertices_.size() - 2], vertices_.back(), next)) {
        vertices_.pop_back();
      }
      vertices_.push_back(next);
    }
    while (after_mean_ + 1 < vertices_.size() && (after_mean_ == 0 || vertices_[after_mean_].x < 0)) ++after_mean_;
  }

  [[nodiscard]] double mean_x() const { return mean_x_; }
  [[nodiscard]] double count() const { return count_; }
  /// The height over the mean of the highest line of this slope that is under all points. Along the hull it has one
  /// minimum, and slopes that are asked for are near to the best one.
  [[nodiscard]] double height(double slope) const {
    const auto at = [&](std::size_t i) { return vertices_[i].y - slope * vertices_[i].x; };
    std::size_t i = after_mean_;
    double least = at(i);
    for (; i + 1 < vertices_.size() && at(i + 1) <= least; ++i) least = at(i + 1);
    for (; i > 0 && at(i - 1) <= least; --i) least = at(i - 1);
    return least;
  }
  /// The slope of the hull over the mean: of the line under all points that is highest in sum.
  [[nodiscard]] double best_slope() const {
    const Vertex &from = vertices_[after_mean_ - 1], &to = vertices_[after_mean_];
    return (to.y - from.y) / (to.x - from.x);
  }
  /// How fast that height falls as the slope leaves the best one, upwards or downwards: the further the faster.
  [[nodiscard]] double fall(bool upwards) const {
    return upwards ? vertices_[after_mean_].x : -vertices_[after_mean_ - 1].x;
  }

 private:
  struct Vertex {
    double x, y;
  };
  static bool turns_up(const Vertex& a, const Vertex& b, const Vertex& c) {
    return (b.y - a.y) * (c.x - b.x) < (c.y - b.y) * (b.x - a.x);
  }

  double mean_x_ = 0, count_ = 0;
  std::vector<Vertex> vertices_;
  std::size_t after_mean_ = 0;  ///< the first vertex there or after, and not the first of all
};

/// The logarithm of the slope's posterior density, but for a constant.
class SlopePosterior {
 public:
  SlopePosterior(std::span<const EdgePoint> points, const Hull& hull, const EdgePrior& prior,
                 const EdgeSettings& settings)
      : hull_(&hull), prior_(prior) {
    const double best = hull.best_slope();
    base_slope_ = std::clamp(best, prior.slope - 4 * prior.sigma, prior.slope + 4 * prior.sigma);
    base_height_ = hull.height(base_slope_);
    std::vector<double> excess;
    excess.reserve(points.size());
    for (const EdgePoint& p : points) {
      excess.push_back(p.count * (p.y_ns - base_height_ - base_slope_ * (p.x_s - hull.mean_x())) +
                       settings.resolution_ns);
    }
    const auto size = static_cast<double>(excess.size());
    used_ = static_cast<std::size_t>(std::clamp(std::ceil(settings.used * size), 4.0, size));
    const auto last = excess.begin() + static_cast<std::ptrdiff_t>(used_) - 1;
    std::nth_element(excess.begin(), last, excess.end());
    const double cap = *last;
    for (const double e : excess) base_sum_ += std::min(e, cap);
    // From the base slope to the prior's, the sum is the most at the prior's and grows the least at the base; there the
    // prior pulls the most.
    const double grows = hull.count() * hull.fall(prior.slope > best), most = sum(hull.height(prior.slope));
    const double pulls = std::abs(prior.slope - best) / (prior.sigma * prior.sigma);
    falls_from_base_ = base_slope_ == best && powers() * grows > 1.001 * pulls * most;
  }

  [[nodiscard]] double used() const { return static_cast<double>(used_); }
  [[nodiscard]] double base_slope() const { return base_slope_; }
  /// The sum of the heights above the highest line of this slope, those beyond the used ones cut.
  [[nodiscard]] double sum(double height) const {
    return std::max(base_sum_ + hull_->count() * (base_height_ - height), 1e-3 * base_sum_);
  }
  [[nodiscard]] double log_density(double slope) const {
    const double pull = (slope - prior_.slope) / prior_.sigma;
    return -powers() * std::log(sum(hull_->height(slope)) / base_sum_) - 0.5 * pull * pull;
  }
  /// The density at each of the slopes, of these sums of heights, against that at another slope; by powers and not by
  /// logarithms, which take several times as long.
  [[nodiscard]] PerSlope densities(const PerSlope& slopes, const PerSlope& sums, double than_slope) const {
    const double than_sum = sum(hull_->height(than_slope)), than_pull = (than_slope - prior_.slope) / prior_.sigma;
    PerSlope out, power;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double pull = (slopes[i] - prior_.slope) / prior_.sigma;
      out[i] = std::exp(0.5 * (than_pull - pull) * (than_pull + pull));
      power[i] = than_sum / sums[i];
    }
    for (std::size_t left = used_ - 1; left > 0; left /= 2) {
      if (left % 2 == 1)
        for (std::size_t i = 0; i < out.size(); ++i) out[i] *= power[i];
      for (double& p : power) p *= p;
    }
    return out;
  }
  /// The densest slope: between what the prior and what the points alone would have.
  [[nodiscard]] double mode() const {
    double low = std::min(base_slope_, prior_.slope), high = std::max(base_slope_, prior_.slope);
    for (int i = 0; i < 60 && high - low > 1e-3; ++i) {
      const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
      const bool beyond_a = falls_from_base_ ? base_slope_ > prior_.slope : log_density(a) < log_density(b);
      (beyond_a ? low : high) = beyond_a ? a : b;
    }
    return 0.5 * (low + high);
  }
  /// Where, going from the mode, the density has fallen so far that the rest does not count.
  [[nodiscard]] double end(double mode, double direction) const {
    const double floor = log_density(mode) - 14;
    const auto counts = [&](double step) { return log_density(mode + direction * step) > floor; };
    // The first power of two of the least step that does not count, or is beyond 16 sigmas of the prior.
    constexpr double kLeast = 1e-3;
    int outside_power = 0;
    if (falls_from_base_) {
      int inside_power = -1;
      outside_power = std::max(0, std::ilogb(prior_.sigma / kLeast) + 5);
      while (outside_power - inside_power > 1) {
        const int middle = (inside_power + outside_power) / 2;
        (counts(std::ldexp(kLeast, middle)) ? inside_power : outside_power) = middle;
      }
    } else {
      for (double step = kLeast; step < 16 * prior_.sigma && counts(step); step *= 2) ++outside_power;
    }
    double outside = std::ldexp(kLeast, outside_power), inside = 0.5 * outside;
    for (int i = 0; i < 5; ++i) {
      const double middle = 0.5 * (inside + outside);
      (counts(middle) ? inside : outside) = middle;
    }
    return mode + direction * outside;
  }

 private:
  [[nodiscard]] double powers() const { return used() - 1; }

  const Hull* hull_;
  EdgePrior prior_;
  double base_slope_ = 0, base_height_ = 0, base_sum_ = 0;
  std::size_t used_ = 0;
  bool falls_from_base_ = false;  ///< the density, from the base slope to either side: it need not be asked which way
};

}  // namespace

std::optional<EdgeFit> fit_edge(std::span<const EdgePoint> points, const EdgePrior& prior, double at_s,
                                const EdgeSettings& settings) {
  if (points.size() < 4) return std::nullopt;
  const Hull hull(points);
  const SlopePosterior posterior(points, hull, prior, settings);
  const double mode = posterior.mode();
  const double low = posterior.end(mode, -1), high = posterior.end(mode, 1);
  PerSlope slopes, heights, sums;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    slopes[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(slopes.size() - 1);
    heights[i] = hull.height(slopes[i]);
    sums[i] = posterior.sum(heights[i]);
  }
  const PerSlope densities = posterior.densities(slopes, sums, mode);

  const double from_mean_s = at_s - hull.mean_x();
  const double shape = posterior.used();
  const double reference_ns = hull.height(mode) + mode * from_mean_s;
  double weights = 0, sum_slope = 0, sum_slope2 = 0, sum_value = 0, sum_value2 = 0, sum_tail2 = 0, sum_sum = 0;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const double weight = densities[i], slope = slopes[i];
    // The level is below the highest possible by a Lomax distribution (an exponential of uncertain rate).
    const double tail = kLean * sums[i] / (hull.count() * std::max(shape - 2, 1.0));
    const double value = heights[i] + slope * from_mean_s - reference_ns - tail;
    weights += weight;
    sum_slope += weight * (slope - mode);
    sum_slope2 += weight * (slope - mode) * (slope - mode);
    sum_value += weight * value;
    sum_value2 += weight * value * value;
    sum_tail2 += weight * tail * tail * shape / (shape - 1);
    sum_sum += weight * sums[i];
  }
  EdgeFit fit;
  const double mean_slope = sum_slope / weights, mean_value = sum_value / weights;
  fit.slope = mode + mean_slope;
  fit.slope_sigma = std::sqrt(std::max(sum_slope2 / weights - mean_slope * mean_slope, 0.0));
  fit.value_ns = reference_ns + mean_value;
  const double variance = std::max(sum_value2 / weights - mean_value * mean_value, 0.0) + sum_tail2 / weights;
  fit.value_sigma_ns = kHalfWidth * std::sqrt(variance);
  fit.spacing_ns = sum_sum / weights / shape;
  return fit;
}

double edge_misfit(std::span<const EdgePoint> points, double spacing_ns) {
  if (points.size() < 2) return 0;
  const Hull hull(points);
  const double slope = hull.best_slope(), height = hull.height(slope);
  double sum = 0;
  for (const EdgePoint& p : points) {
    sum += std::min(p.count * (p.y_ns - height - slope * (p.x_s - hull.mean_x())) / spacing_ns, 5.0);
  }
  return sum;
}

}  // namespace birdseye
