#include "calibration/time/edge_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace birdseye {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Half the width that holds 68.3 % of this posterior is less than its standard deviation, for it has an exponential
/// tail to one side. 0.83 for an exponential alone; this is the ratio for a line's end, which mixes two of them.
constexpr double kHalfWidth = 0.91;
constexpr double kLean = 1.15;

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
  }

  [[nodiscard]] double mean_x() const { return mean_x_; }
  [[nodiscard]] double count() const { return count_; }
  /// The height over the mean of the highest line of this slope that is under all points.
  [[nodiscard]] double height(double slope) const {
    double least = kInfinite;
    for (const Vertex& v : vertices_) least = std::min(least, v.y - slope * v.x);
    return least;
  }
  /// The slope of the hull over the mean: of the line under all points that is highest in sum.
  [[nodiscard]] double best_slope() const {
    for (std::size_t i = 1; i < vertices_.size(); ++i) {
      if (vertices_[i].x >= 0) return (vertices_[i].y - vertices_[i - 1].y) / (vertices_[i].x - vertices_[i - 1].x);
    }
    return 0;
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
};

/// The logarithm of the slope's posterior density, but for a constant.
class SlopePosterior {
 public:
  SlopePosterior(std::span<const EdgePoint> points, const Hull& hull, const EdgePrior& prior,
                 const EdgeSettings& settings)
      : hull_(&hull), prior_(prior) {
    base_slope_ = std::clamp(hull.best_slope(), prior.slope - 4 * prior.sigma, prior.slope + 4 * prior.sigma);
    base_height_ = hull.height(base_slope_);
    std::vector<double> excess;
    excess.reserve(points.size());
    for (const EdgePoint& p : points) {
      excess.push_back(p.count * (p.y_ns - base_height_ - base_slope_ * (p.x_s - hull.mean_x())) +
                       settings.resolution_ns);
    }
    const auto size = static_cast<double>(excess.size());
    const auto used = static_cast<std::size_t>(std::clamp(std::ceil(settings.used * size), 4.0, size));
    const auto last = excess.begin() + static_cast<std::ptrdiff_t>(used) - 1;
    std::nth_element(excess.begin(), last, excess.end());
    const double cap = *last;
    for (const double e : excess) base_sum_ += std::min(e, cap);
    used_ = static_cast<double>(used);
  }

  [[nodiscard]] double used() const { return used_; }
  [[nodiscard]] double base_slope() const { return base_slope_; }
  /// The sum of the heights above the highest line of this slope, those beyond the used ones cut.
  [[nodiscard]] double sum(double height) const {
    return std::max(base_sum_ + hull_->count() * (base_height_ - height), 1e-3 * base_sum_);
  }
  [[nodiscard]] double log_density(double slope) const {
    const double pull = (slope - prior_.slope) / prior_.sigma;
    return -(used_ - 1) * std::log(sum(hull_->height(slope)) / base_sum_) - 0.5 * pull * pull;
  }
  /// The densest slope: between what the prior and what the points alone would have.
  [[nodiscard]] double mode() const {
    double low = std::min(base_slope_, prior_.slope), high = std::max(base_slope_, prior_.slope);
    for (int i = 0; i < 60 && high - low > 1e-3; ++i) {
      const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
      const bool beyond_a = log_density(a) < log_density(b);
      (beyond_a ? low : high) = beyond_a ? a : b;
    }
    return 0.5 * (low + high);
  }
  /// Where, going from the mode, the density has fallen so far that the rest does not count.
  [[nodiscard]] double end(double mode, double direction) const {
    const double floor = log_density(mode) - 14;
    double step = 1e-3;
    while (step < 16 * prior_.sigma && log_density(mode + direction * step) > floor) step *= 2;
    double inside = 0.5 * step, outside = step;
    for (int i = 0; i < 5; ++i) {
      const double middle = 0.5 * (inside + outside);
      (log_density(mode + direction * middle) > floor ? inside : outside) = middle;
    }
    return mode + direction * outside;
  }

 private:
  const Hull* hull_;
  EdgePrior prior_;
  double base_slope_ = 0, base_height_ = 0, base_sum_ = 0, used_ = 0;
};

}  // namespace

std::optional<EdgeFit> fit_edge(std::span<const EdgePoint> points, const EdgePrior& prior, double at_s,
                                const EdgeSettings& settings) {
  if (points.size() < 4) return std::nullopt;
  const Hull hull(points);
  const SlopePosterior posterior(points, hull, prior, settings);
  const double mode = posterior.mode();
  const double low = posterior.end(mode, -1), high = posterior.end(mode, 1);
  const double peak = posterior.log_density(mode);

  constexpr int kSteps = 64;
  const double from_mean_s = at_s - hull.mean_x();
  const double shape = posterior.used();
  const double reference_ns = hull.height(mode) + mode * from_mean_s;
  double weights = 0, sum_slope = 0, sum_slope2 = 0, sum_value = 0, sum_value2 = 0, sum_tail2 = 0, sum_sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double slope = low + (high - low) * i / kSteps;
    const double height = hull.height(slope), heights = posterior.sum(height);
    const double weight = std::exp(posterior.log_density(slope) - peak);
    // The level is below the highest possible by a Lomax distribution (an exponential of uncertain rate).
    const double tail = kLean * heights / (hull.count() * std::max(shape - 2, 1.0));
    const double value = height + slope * from_mean_s - reference_ns - tail;
    weights += weight;
    sum_slope += weight * (slope - mode);
    sum_slope2 += weight * (slope - mode) * (slope - mode);
    sum_value += weight * value;
    sum_value2 += weight * value * value;
    sum_tail2 += weight * tail * tail * shape / (shape - 1);
    sum_sum += weight * heights;
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
