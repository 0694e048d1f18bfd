#pragma once

#include <optional>
#include <span>

namespace birdseye {

/// The lowest of `count` arrivals.
struct EdgePoint {
  double x_s = 0;   ///< nominal time; points come in its order
  double y_ns = 0;  ///< arrival behind nominal time
  double count = 1;
};

/// What is known of the slope beforehand: ns of lateness gained per nominal second, normally distributed.
struct EdgePrior {
  double slope = 0;
  double sigma = 3e5;
};

/// The line below which no arrival comes, at a time that was asked for.
struct EdgeFit {
  double value_ns = 0, value_sigma_ns = 0;
  double slope = 0, slope_sigma = 0;  ///< ns per second
  double spacing_ns = 0;              ///< what one arrival is above the edge on average, by those near to it
};

struct EdgeSettings {
  /// The share of points, nearest to the edge first, whose heights tell how densely arrivals lie there. Of the others
  /// only that they are farther away is used, so arrivals far from the edge may be distributed in any way.
  double used = 0.5;
  double resolution_ns = 1000;  ///< of arrival stamps: the edge is not sharper than this
};

/// The posterior mean and deviation of a line under which no point lies. Close to their edge arrivals are taken to be a
/// Poisson process of unknown density, which holds for every jitter whose density does not vanish there: the heights
/// above the line then are exponential, n of them at a time with n times the rate, and density and level integrate in
/// closed form, the slope by quadrature. Empty for fewer than four points. docs/clocks.md has the formulas.
std::optional<EdgeFit> fit_edge(std::span<const EdgePoint> points, const EdgePrior& prior, double at_s,
                                const EdgeSettings& settings);

/// How far the points lie above the best line under them, in units of spacing_ns, no point counted for more than five.
/// Where two lines for the parts of a window have a much lower sum than one line for all of it, the clock has changed.
double edge_misfit(std::span<const EdgePoint> points, double spacing_ns);

}  // namespace birdseye
