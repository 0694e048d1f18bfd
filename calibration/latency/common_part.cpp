#include "calibration/latency/common_part.hpp"

#include <algorithm>

#include "calibration/base/median.hpp"
#include "calibration/latency/latency_limits.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kHolePeriods = 3.5;  // of a slow stream, whose every interval is longer than a hole

Stretch span_of(const MotionSpline::Sample& sample) {
  return {sample.time_s, sample.time_s};
}
Stretch span_of(const ImageMotion& sample) {
  return {sample.from_s, sample.to_s};
}

template <typename Sample>
std::vector<Stretch> stretches_of_all(const std::vector<Sample>& samples) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < samples.size(); ++i)
    intervals_s.push_back(span_of(samples[i]).second - span_of(samples[i - 1]).second);
  std::vector<Stretch> stretches;
  if (intervals_s.empty()) return stretches;
  const double hole_s = std::max(kLongGapS, kHolePeriods * median_of(std::move(intervals_s)));
  for (const Sample& sample : samples) {
    const auto [from_s, to_s] = span_of(sample);
    if (stretches.empty() || from_s - stretches.back().second > hole_s) {
      stretches.emplace_back(from_s, to_s);
    } else {
      stretches.back().second = std::max(stretches.back().second, to_s);
    }
  }
  return stretches;
}

template <typename Sample>
double longest_gap_of(const std::vector<Sample>& samples, double from_s, double to_s) {
  double longest_s = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double before_s = span_of(samples[i - 1]).second, after_s = span_of(samples[i]).second;
    if (before_s >= from_s && after_s <= to_s) longest_s = std::max(longest_s, after_s - before_s);
  }
  return longest_s;
}

template <typename Sample>
void keep_all_near(const std::vector<Stretch>& stretches, double margin_s, std::vector<Sample>& samples) {
  auto stretch = stretches.begin();
  const auto is_far = [&](const Sample& sample) {
    const auto [from_s, to_s] = span_of(sample);
    while (stretch != stretches.end() && stretch->second + margin_s < from_s) ++stretch;
    return stretch == stretches.end() || to_s < stretch->first - margin_s;
  };
  std::vector<Sample> near;
  for (const Sample& sample : samples) {
    if (!is_far(sample)) near.push_back(sample);
  }
  samples = std::move(near);
}

}  // namespace

std::vector<Stretch> stretches_of(const MotionSamples& samples) {
  return stretches_of_all(samples);
}
std::vector<Stretch> stretches_of(const std::vector<ImageMotion>& samples) {
  return stretches_of_all(samples);
}

std::vector<Stretch> common_stretches(const std::vector<Stretch>& a, const std::vector<Stretch>& b) {
  std::vector<Stretch> common;
  for (auto of_a = a.begin(), of_b = b.begin(); of_a != a.end() && of_b != b.end();) {
    const Stretch both{std::max(of_a->first, of_b->first), std::min(of_a->second, of_b->second)};
    if (both.first < both.second) common.push_back(both);
    ++(of_a->second < of_b->second ? of_a : of_b);
  }
  return common;
}

double seconds_of(const std::vector<Stretch>& stretches) {
  double sum_s = 0;
  for (const auto& [from_s, to_s] : stretches) sum_s += to_s - from_s;
  return sum_s;
}

double longest_gap_s(const MotionSamples& samples, double from_s, double to_s) {
  return longest_gap_of(samples, from_s, to_s);
}
double longest_gap_s(const std::vector<ImageMotion>& samples, double from_s, double to_s) {
  return longest_gap_of(samples, from_s, to_s);
}

void keep_near(const std::vector<Stretch>& stretches, double margin_s, MotionSamples& samples) {
  keep_all_near(stretches, margin_s, samples);
}
void keep_near(const std::vector<Stretch>& stretches, double margin_s, std::vector<ImageMotion>& samples) {
  keep_all_near(stretches, margin_s, samples);
}

}  // namespace birdseye::calibration
