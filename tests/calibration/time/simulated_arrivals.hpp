#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

namespace birdseye::testing {

enum class Jitter { uniform, half_normal, exponential, bursts, soft };

inline std::string name_of(Jitter jitter) {
  switch (jitter) {
    case Jitter::uniform:
      return "uniform";
    case Jitter::half_normal:
      return "half-normal";
    case Jitter::exponential:
      return "exponential";
    case Jitter::bursts:
      return "bursts";
    case Jitter::soft:
      break;
  }
  return "soft";
}

/// A periodic instrument whose clock drifts, and a machine that stamps its measurements late, in their order.
struct SimulatedArrivals {
  double rate_hz = 144;
  double jitter_ms = 5;  ///< uniform: the most; half-normal: its deviation; others: the mean
  Jitter jitter = Jitter::uniform;
  double drift_ppm = 50;
  std::mt19937_64 rng;

  double instrument_s = 0, last_arrival_s = 0, busy_until_s = 0;

  explicit SimulatedArrivals(std::uint64_t seed) : rng(seed) {}

  [[nodiscard]] std::int64_t period_ns() const { return static_cast<std::int64_t>(std::llround(1e9 / rate_hz)); }
  [[nodiscard]] double uniform() { return std::uniform_real_distribution<double>(0, 1)(rng); }

  /// The next measurement happens: its true time, s.
  double measure() {
    instrument_s += static_cast<double>(period_ns()) * 1e-9 * (1 + drift_ppm * 1e-6);
    return instrument_s;
  }
  /// When the measurement of that time is stamped. What is late on purpose is later by `more_s`.
  double arrival_of(double true_s, double more_s = 0) {
    double late_s = jitter_ms * 1e-3 * draw();
    if (jitter == Jitter::bursts) {
      if (true_s > busy_until_s && uniform() < 0.3 / rate_hz) busy_until_s = true_s + 0.1 * uniform();
      if (true_s < busy_until_s) late_s += busy_until_s - true_s;
    }
    last_arrival_s = std::max(last_arrival_s, true_s + more_s + late_s);
    return last_arrival_s;
  }

 private:
  double draw() {
    switch (jitter) {
      case Jitter::uniform:
        return uniform();
      case Jitter::half_normal:
        return std::abs(std::normal_distribution<double>(0, 1)(rng));
      case Jitter::exponential:
      case Jitter::bursts:
        return std::exponential_distribution<double>(1)(rng);
      case Jitter::soft:
        break;
    }
    return std::gamma_distribution<double>(2, 0.5)(rng);
  }
};

}  // namespace birdseye::testing
