#include "calibration/time/edge_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace birdseye {
namespace {

/// The posterior of docs/clocks.md as it stands there: over many slopes, without a hull and without a search.
class Plain {
 public:
  Plain(const std::vector<EdgePoint>& points, const EdgePrior& prior, const EdgeSettings& settings)
      : points_(points), prior_(prior) {
    double sum_x = 0;
    for (const EdgePoint& p : points) {
      sum_x += p.count * p.x_s;
      count_ += p.count;
    }
    mean_x_ = sum_x / count_;
    best_ = std::clamp(best_slope(), prior.slope - 4 * prior.sigma, prior.slope + 4 * prior.sigma);
    for (const EdgePoint& p : points) excess_.push_back(p.count * above(p, best_) + settings.resolution_ns);
    std::ranges::sort(excess_);
    used_ = std::max<std::size_t>(
        4, static_cast<std::size_t>(std::ceil(settings.used * static_cast<double>(excess_.size()))));
    for (const double e : excess_) base_sum_ += std::min(e, excess_[used_ - 1]);
  }

  [[nodiscard]] EdgeFit fit(double at_s) const {
    // Where the density is not nothing: first roughly, then again within.
    double low = std::min(best_, prior_.slope) - 8 * prior_.sigma;
    double high = std::max(best_, prior_.slope) + 8 * prior_.sigma;
    for (int zoom = 0; zoom < 6; ++zoom) {
      const std::vector<double> logs = log_densities(low, high, 4000);
      const double floor = *std::ranges::max_element(logs) - 20;
      const auto counts = [&](double log) { return log > floor; };
      const auto first = std::ranges::find_if(logs, counts) - logs.begin();
      const auto last = logs.rend() - std::find_if(logs.rbegin(), logs.rend(), counts);
      const double step = (high - low) / 4000, from = low;
      low = from + step * static_cast<double>(first - 1);
      high = from + step * static_cast<double>(last);
    }
    return integral(low, high, at_s);
  }

 private:
  [[nodiscard]] double height(double slope) const {
    double least = std::numeric_limits<double>::infinity();
    for (const EdgePoint& p : points_) least = std::min(least, p.y_ns - slope * (p.x_s - mean_x_));
    return least;
  }
  [[nodiscard]] double above(const EdgePoint& p, double slope) const {
    return p.y_ns - slope * (p.x_s - mean_x_) - height(slope);
  }
  /// Of the line through two points that has none under it, and one on either side of the mean.
  [[nodiscard]] double best_slope() const {
    double best = 0, most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      for (std::size_t j = i + 1; j < points_.size(); ++j) {
        const double slope = (points_[j].y_ns - points_[i].y_ns) / (points_[j].x_s - points_[i].x_s);
        if (height(slope) > most) {
          most = height(slope);
          best = slope;
        }
      }
    }
    return best;
  }
  [[nodiscard]] double sum(double slope) const {
    return std::max(base_sum_ + count_ * (height(best_) - height(slope)), 1e-3 * base_sum_);
  }
  [[nodiscard]] double log_density(double slope) const {
    const double pull = (slope - prior_.slope) / prior_.sigma;
    return -(static_cast<double>(used_) - 1) * std::log(sum(slope) / base_sum_) - 0.5 * pull * pull;
  }
  [[nodiscard]] std::vector<double> log_densities(double low, double high, int steps) const {
    std::vector<double> out;
    for (int i = 0; i <= steps; ++i) out.push_back(log_density(low + (high - low) * i / steps));
    return out;
  }
  [[nodiscard]] EdgeFit integral(double low, double high, double at_s) const {
    constexpr int kSteps = 4000;
    const std::vector<double> logs = log_densities(low, high, kSteps);
    const double peak = *std::ranges::max_element(logs), shape = static_cast<double>(used_);
    double weights = 0, slopes = 0, slopes2 = 0, values = 0, values2 = 0, tails2 = 0, sums = 0;
    const double origin_ns = height(best_) + best_ * (at_s - mean_x_);
    for (int i = 0; i <= kSteps; ++i) {
      const double slope = low + (high - low) * i / kSteps, weight = std::exp(logs[static_cast<std::size_t>(i)] - peak);
      const double tail = 1.15 * sum(slope) / (count_ * (shape - 2));
      const double value = height(slope) + slope * (at_s - mean_x_) - tail - origin_ns;
      weights += weight;
      slopes += weight * (slope - best_);
      slopes2 += weight * (slope - best_) * (slope - best_);
      values += weight * value;
      values2 += weight * value * value;
      tails2 += weight * tail * tail * shape / (shape - 1);
      sums += weight * sum(slope);
    }
    const double slope = slopes / weights, value = values / weights;
    return {origin_ns + value, 0.91 * std::sqrt(values2 / weights - value * value + tails2 / weights), best_ + slope,
            std::sqrt(slopes2 / weights - slope * slope), sums / weights / shape};
  }

  std::vector<EdgePoint> points_;
  EdgePrior prior_;
  double mean_x_ = 0, count_ = 0, best_ = 0, base_sum_ = 0;
  std::vector<double> excess_;
  std::size_t used_ = 0;
};

TEST(EdgeFit, IsThePosteriorsMeanAndDeviation) {
  constexpr int kSeeds = 60;
  double lean = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
    const std::size_t size = 8 + random() % 50;
    const double drift = 2e5 * (uniform() - 0.5), jitter_ns = std::pow(10, 4 + 2.5 * uniform());
    const double span_s = 0.3 * static_cast<double>(size), count = 1 + static_cast<double>(random() % 32);
    std::vector<EdgePoint> points;
    for (std::size_t i = 0; i < size; ++i) {
      const double x_s = 0.3 * static_cast<double>(i);
      points.push_back({x_s, drift * x_s - jitter_ns / count * std::log(1 - uniform()), count});
    }
    // From one that says more than the points to one that says hardly anything.
    const double sigma = jitter_ns / (span_s * count * static_cast<double>(size)) * std::pow(10, -1 + 3 * uniform());
    const EdgePrior prior{drift + 6 * sigma * (uniform() - 0.5), sigma};
    const EdgeSettings settings{0.8, 1000};
    const auto fit = fit_edge(points, prior, span_s, settings);
    const EdgeFit plain = Plain(points, prior, settings).fit(span_s);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->value_ns, plain.value_ns, 0.05 * plain.value_sigma_ns) << seed;
    EXPECT_NEAR(fit->slope, plain.slope, 0.05 * plain.slope_sigma) << seed;
    EXPECT_NEAR(fit->value_sigma_ns / plain.value_sigma_ns, 1, 0.05) << seed;
    EXPECT_NEAR(fit->slope_sigma / plain.slope_sigma, 1, 0.05) << seed;
    EXPECT_NEAR(fit->spacing_ns / plain.spacing_ns, 1, 0.05) << seed;
    lean += (fit->slope_sigma / plain.slope_sigma - 1) / kSeeds;
  }
  EXPECT_NEAR(lean, 0, 0.005);  // of a quadrature over 65 slopes, to both sides
}

}  // namespace
}  // namespace birdseye
