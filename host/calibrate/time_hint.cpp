#include "host/calibrate/time_hint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "calibration/base/median.hpp"
#include "host/files/column_names.hpp"

namespace birdseye::host {

namespace {

struct Span {
  double from_s = 0, to_s = 0;
  [[nodiscard]] double length_s() const { return to_s - from_s; }
  [[nodiscard]] Span scaled(double by) const { return {by * from_s, by * to_s}; }
};

Span span_of(const PoseSet& set) {
  return {set.poses.front().time_s, set.poses.back().time_s};
}

/// Whether both last about equally long, and share most of the shorter one.
bool fit(const Span& a, const Span& b) {
  constexpr double kMostLonger = 20, kLeastShared = 0.5;
  const double shorter_s = std::min(a.length_s(), b.length_s()), longer_s = std::max(a.length_s(), b.length_s());
  const double shared_s = std::min(a.to_s, b.to_s) - std::max(a.from_s, b.from_s);
  return shorter_s > 0 && longer_s < kMostLonger * shorter_s && shared_s > kLeastShared * shorter_s;
}

/// Whether poses come as fast as trackers and cameras give them.
bool steps_are_likely(const PoseSet& set) {
  constexpr double kLeast_s = 5e-4, kMost_s = 5;
  std::vector<double> steps_s;
  steps_s.reserve(set.poses.size());
  for (std::size_t i = 1; i < set.poses.size(); ++i) steps_s.push_back(set.poses[i].time_s - set.poses[i - 1].time_s);
  const double step_s = median_of(std::move(steps_s));
  return step_s > kLeast_s && step_s < kMost_s;
}

/// The unit in which the first one's times would fit the other's, s.
std::optional<double> fitting_unit(const TimedFile& one, const TimedFile& other) {
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    const double by = unit_s / one.s_per_unit;
    if (std::abs(std::log(by)) > 1 && fit(span_of(one.set).scaled(by), span_of(other.set))) return unit_s;
  }
  return std::nullopt;
}

}  // namespace

std::string hint_on_time_units(const TimedFile& a, const TimedFile& b) {
  if (a.set.poses.empty() || b.set.poses.empty() || fit(span_of(a.set), span_of(b.set))) return {};
  // Either may be the one: first the one whose poses come too seldom or too fast.
  const bool b_first = steps_are_likely(a.set) && !steps_are_likely(b.set);
  for (const bool of_b : {b_first, !b_first}) {
    const TimedFile& one = of_b ? b : a;
    const auto unit_s = fitting_unit(one, of_b ? a : b);
    if (!unit_s) continue;
    const Span span = span_of(one.set).scaled(*unit_s / one.s_per_unit);
    const char* const letters = *unit_s == 1 ? "s" : *unit_s == 1e-3 ? "ms" : *unit_s == 1e-6 ? "us" : "ns";
    return fmt::format(
        "the times of {} seem to be in {}, not in {}: so they last from {:.3f} to {:.3f} s, as the other's "
        "do: say {} {}",
        one.name, name_of_seconds(*unit_s), name_of_seconds(one.s_per_unit), span.from_s, span.to_s, one.option,
        letters);
  }
  return {};
}

}  // namespace birdseye::host
