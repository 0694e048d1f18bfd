#include "calibration/time/strobe_matcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace birdseye {
namespace {

constexpr std::size_t kFrames = 64, kEdges = 256;
/// An edge or frame this near to where it is expected, in periods, is it.
constexpr double kNear = 0.4;
/// By so many contradictions more than the best must every other delay have.
constexpr int kClear = 3;
constexpr int kMisses = 12;
/// Over so many frames, the nominal period is not good enough to count edges by.
constexpr std::int64_t kMostCounted = 2000;

}  // namespace

void StrobeMatcher::push_edge(DeviceTime edge) {
  Edge next{edge, false};
  if (!edges_.empty() && (edge - edges_.back().at).ns < settings_.period.ns / 2) {
    // One of the two is not a frame's, and nothing says which.
    edges_.back().doubtful = next.doubtful = true;
    ++spurious_;
  }
  edges_.push_back(next);
  if (edges_.size() > kEdges) edges_.pop_front();
}

std::optional<Duration> StrobeMatcher::delay() const {
  if (!delay_ns_) return std::nullopt;
  return Duration{std::llround(*delay_ns_)};
}

const StrobeMatcher::Edge* StrobeMatcher::nearest(DeviceTime time) const {
  auto after =
      std::lower_bound(edges_.begin(), edges_.end(), time, [](const Edge& e, DeviceTime t) { return e.at < t; });
  const auto apart = [&](auto edge) { return std::abs((edge->at - time).ns); };
  if (after == edges_.end() || (after != edges_.begin() && apart(std::prev(after)) < apart(after))) {
    if (after == edges_.begin()) return nullptr;
    --after;
  }
  if (static_cast<double>(apart(after)) > kNear * static_cast<double>(settings_.period.ns)) return nullptr;
  return &*after;
}

/// The delay but for whole periods: the circular mean. Empty where frames scatter too much about it to tell them apart.
std::optional<double> StrobeMatcher::phase_ns() const {
  const auto period = static_cast<double>(settings_.period.ns);
  double sine = 0, cosine = 0, count = 0;
  for (const NumberedFrame& frame : frames_) {
    const auto after = std::lower_bound(edges_.begin(), edges_.end(), frame.stamp,
                                        [](const Edge& e, DeviceTime t) { return e.at < t; });
    if (after == edges_.begin() || std::prev(after)->doubtful) continue;
    const double angle = 2 * std::numbers::pi * static_cast<double>((frame.stamp - std::prev(after)->at).ns) / period;
    sine += std::sin(angle);
    cosine += std::cos(angle);
    ++count;
  }
  if (count < static_cast<double>(settings_.learn_from) || std::hypot(sine, cosine) < 0.7 * count) return std::nullopt;
  const double turn = std::atan2(sine, cosine) / (2 * std::numbers::pi);
  return (turn - std::floor(turn)) * period;
}

/// Frames without an edge, and edges without a frame where the camera's count does not say that frames were lost.
int StrobeMatcher::contradictions(double delay_ns) const {
  const Duration delay{std::llround(delay_ns)};
  int count = 0;
  for (const NumberedFrame& frame : frames_) count += nearest(frame.stamp - delay) == nullptr ? 1 : 0;
  const Duration near{std::llround(kNear * static_cast<double>(settings_.period.ns))};
  for (const Edge& edge : edges_) {
    const DeviceTime expected = edge.at + delay;
    if (edge.doubtful || expected < frames_.front().stamp - near || frames_.back().stamp < expected) continue;
    const auto after = std::lower_bound(frames_.begin(), frames_.end(), expected - near,
                                        [](const NumberedFrame& f, DeviceTime t) { return f.stamp < t; });
    if (after == frames_.end() || after->stamp <= expected + near) continue;
    if (after != frames_.begin() && after->number - std::prev(after)->number > 1) continue;
    ++count;
  }
  return count;
}

void StrobeMatcher::learn() {
  if (frames_.size() < settings_.learn_from) return;
  const auto phase = phase_ns();
  if (!phase) {
    ambiguity_ = "frames come too unevenly after the strobe to tell which edge is theirs";
    return;
  }
  const auto period = static_cast<double>(settings_.period.ns), least = static_cast<double>(settings_.least_delay.ns);
  int fewest = std::numeric_limits<int>::max(), second = fewest;
  double best = 0;
  const auto most = static_cast<double>(settings_.most_delay.ns);
  const auto first = static_cast<int>(std::ceil((least - *phase) / period));
  const auto last = static_cast<int>(std::floor((most - *phase) / period));
  for (int n = first; n <= last; ++n) {
    const double delay = *phase + n * period;
    const int found = contradictions(delay);
    if (found < fewest) {
      second = std::exchange(fewest, found);
      best = delay;
    } else {
      second = std::min(second, found);
    }
  }
  if (fewest == std::numeric_limits<int>::max() || static_cast<std::size_t>(fewest) > frames_.size() / 4) {
    ambiguity_ = fmt::format("no delay from {:.0f} to {:.0f} ms fits frames and strobe", least * 1e-6,
                             settings_.most_delay.seconds() * 1e3);
  } else if (second - fewest < kClear) {
    ambiguity_ = "delays that differ by a period fit frames and strobe as well";
  } else if (before_ && !is_as_before(best) && !is_clear_beyond_bounds(best, fewest)) {
    ambiguity_ = "frames and strobe edges have been counted differently: the delay may have changed by a period";
  } else {
    delay_ns_ = best;
    before_.reset();
    misses_ = 0;
  }
}

/// The delay that was lost is back, and nothing was counted differently meanwhile.
bool StrobeMatcher::is_as_before(double delay_ns) const {
  const auto period = static_cast<double>(settings_.period.ns);
  if (std::abs(delay_ns - before_->delay_ns) > period / 4) return false;
  const NumberedFrame& frame = frames_.back();
  const std::int64_t counted = frame.number - before_->last.number;
  const Edge* edge = nearest(frame.stamp - Duration{std::llround(delay_ns)});
  return edge != nullptr && counted < kMostCounted &&
         std::llround(static_cast<double>((edge->at - before_->last.edge).ns) / period) == counted;
}

/// A delay that has changed may have left its bounds: frames and edges alone must tell it from the next ones.
bool StrobeMatcher::is_clear_beyond_bounds(double delay_ns, int its_contradictions) const {
  for (const int periods : {-2, -1, 1, 2}) {
    const double other = delay_ns + periods * static_cast<double>(settings_.period.ns);
    if (other >= 0 && contradictions(other) - its_contradictions < kClear) return false;
  }
  return true;
}

void StrobeMatcher::forget() {
  if (delay_ns_ && last_) before_ = Before{*last_, *delay_ns_};
  frames_.clear();
  delay_ns_.reset();
  last_.reset();
  misses_ = 0;
}

StrobeMatcher::Match StrobeMatcher::match(DeviceTime stamp, std::int64_t number) {
  if (!frames_.empty() && (number <= frames_.back().number || stamp <= frames_.back().stamp)) {
    forget();
    before_.reset();  // another stream
  }
  frames_.push_back({stamp, number});
  if (frames_.size() > kFrames) frames_.pop_front();
  if (!delay_ns_) learn();
  if (!delay_ns_) return {std::nullopt, {}, ambiguity_};

  const Edge* edge = nearest(stamp - Duration{std::llround(*delay_ns_)});
  if (edge == nullptr || edge->doubtful) {
    // One edge lost is one frame without; many are a delay that has changed.
    if (++misses_ >= kMisses) forget();
    return {std::nullopt,
            {},
            edge == nullptr ? "no strobe edge where this frame's should be" : "two strobe edges for one frame"};
  }
  misses_ = 0;
  if (last_) {
    const double periods = static_cast<double>((edge->at - last_->edge).ns) / static_cast<double>(settings_.period.ns);
    if (edge->at <= last_->edge || std::llround(periods) != number - last_->number) {
      // The camera counted other than the strobe: from here on the delay may be another one, by a whole period.
      forget();
      ambiguity_ = "frames and strobe edges have been counted differently";
      return {std::nullopt, {}, ambiguity_};
    }
  }
  last_ = Pair{edge->at, number};
  const double miss = static_cast<double>((stamp - edge->at).ns) - *delay_ns_;
  *delay_ns_ += 0.02 * miss;
  return {edge->at + Duration{settings_.exposure.ns / 2}, settings_.edge_sigma, {}};
}

}  // namespace birdseye
