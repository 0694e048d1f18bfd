#include "calibration/time/clock_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye {
namespace {

/// A doubt that lasts so long is given up.
constexpr std::int64_t kGiveUpNs = 1'800'000'000;
/// What chance explains only once in e^kDoubted times is not to be relied on.
constexpr double kDoubted = 9, kSafeSigmas = 16;

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

}  // namespace

const char* to_string(ClockEvent::Kind kind) {
  switch (kind) {
    case ClockEvent::Kind::step:
      return "step";
    case ClockEvent::Kind::slip:
      return "slip";
    case ClockEvent::Kind::drift_change:
      return "drift change";
    case ClockEvent::Kind::restart:
      break;
  }
  return "restart";
}

ClockLine::ClockLine(const Settings& settings) : settings_(settings), prior_{0, settings.drift_sigma_ppm * 1e3} {
  const std::int64_t most =
      settings_.window.ns / static_cast<std::int64_t>(kBlocks) / std::max<std::int64_t>(1, settings_.period.ns);
  while (full_span_ * 2 <= most) full_span_ *= 2;
}

std::int64_t ClockLine::offset_of(const Arrival& arrival) const {
  return arrival.arrived_ns - origin_ns_ - arrival.index * settings_.period.ns;
}

double ClockLine::seconds_to(std::int64_t index) const {
  return static_cast<double>((index - anchor_index_) * settings_.period.ns) * 1e-9;
}

double ClockLine::true_period_ns() const {
  return static_cast<double>(settings_.period.ns) * (1 + fit_.slope * 1e-9);
}

double ClockLine::line_at(std::int64_t index) const {
  return fit_.value_ns + fit_.slope * static_cast<double>((index - fit_index_) * settings_.period.ns) * 1e-9;
}

double ClockLine::sigma_at(std::int64_t index) const {
  const double ahead_s = static_cast<double>((index - fit_index_) * settings_.period.ns) * 1e-9;
  const double seen_s = blocks_.empty() ? 0 : seconds_to(fit_index_);
  // A drift that wanders bends the line: by a twelfth of its square at the end of a fitted window, and freely beyond.
  const double bend_ns = settings_.wander_ppm_per_s * 1e3 * (seen_s * seen_s / 12 + ahead_s * ahead_s / 2);
  return std::sqrt(fit_.value_sigma_ns * fit_.value_sigma_ns + fit_.slope_sigma * fit_.slope_sigma * ahead_s * ahead_s +
                   bend_ns * bend_ns + static_cast<double>(settings_.resolution.ns * settings_.resolution.ns));
}

/// What is later than this may be of a later measurement than it is counted for. The line's own error has a tail of the
/// exponential kind, hence so many sigmas.
double ClockLine::may_be_the_next() const {
  const auto period = static_cast<double>(settings_.period.ns);
  return numbered_ ? std::numeric_limits<double>::infinity()
                   : period - std::min(kSafeSigmas * sigma_at(index_), 0.5 * period);
}

double ClockLine::drift_sigma_ppm() const {
  const double seen_s = blocks_.empty() ? 0 : seconds_to(fit_index_);
  return std::hypot(fit_.slope_sigma * 1e-3, settings_.wander_ppm_per_s * seen_s / 2);
}

std::vector<ClockEvent> ClockLine::take_events() {
  std::vector<ClockEvent> events(events_.begin(), events_.end());
  events_.clear();
  return events;
}

void ClockLine::report(ClockEvent event) {
  if (events_.size() == 64) events_.pop_front();
  events_.push_back(event);
}

void ClockLine::restart(DeviceTime arrived) {
  blocks_.clear();
  recent_.clear();
  past_drifts_.clear();
  change_.reset();
  span_ = 1;
  since_begin_ = 0;
  index_ = 0;
  suspect_from_.reset();
  slip_from_.reset();
  skipped_ = {};
  origin_ns_ = arrived.ns;
  prior_ = {0, settings_.drift_sigma_ppm * 1e3};
  calm_drifts_.fill({0, prior_.slope, prior_.sigma});
}

ClockLine::Tick ClockLine::push(DeviceTime arrived, std::int64_t lost, bool perhaps_more) {
  if (index_ < 0) {
    restart(arrived);
  } else {
    index_ += 1 + std::max<std::int64_t>(0, lost);
    if (lost > 0) skipped_ = {index_, lost};
    if (perhaps_more) suspect_from_ = index_;
  }
  return place(arrived);
}

ClockLine::Tick ClockLine::push_numbered(DeviceTime arrived, std::int64_t number) {
  const bool elsewhere = number - first_number_ <= index_ || number - first_number_ - index_ > kMostMissing;
  if (index_ < 0 || elsewhere) {
    if (index_ >= 0) {
      report({ClockEvent::Kind::restart, arrived, 0, 0});
      ++restarts_;
    }
    restart(arrived);
    first_number_ = number;
    numbered_ = true;
  } else {
    index_ = number - first_number_;
  }
  return place(arrived);
}

ClockLine::Tick ClockLine::place(DeviceTime arrived) {
  Arrival arrival{index_, arrived.ns, 0, false};
  bool certain = since_begin_ >= settings_.slip_confirms;
  ++since_begin_;
  if (blocks_.size() < 4 && span_ == 1) {
    add(arrival);
    refit();
    remember(arrival);
  } else {
    arrival.late_ns = static_cast<double>(offset_of(arrival) - anchor_offset_ns_) - line_at(index_);
    if (look_for_early(arrival)) {
      certain = false;
    } else {
      arrival.held = arrival.late_ns > may_be_the_next();
      if (!arrival.held) {
        release();
        add(arrival);
        if (blocks_.size() > 1 && blocks_.back().count == 1 && span_ == full_span_) look_for_bend();
      }
      remember(arrival);
      certain = look_for_late() < kDoubted && certain;
      refit();
    }
  }
  Tick tick;
  const double line_ns = line_at(index_);
  tick.time = {origin_ns_ + index_ * settings_.period.ns + anchor_offset_ns_ + std::llround(line_ns)};
  tick.late_by = arrived - tick.time;
  tick.index = index_;
  tick.certain =
      certain && since_begin_ > settings_.slip_confirms && static_cast<double>(tick.late_by.ns) <= may_be_the_next();
  look_for_a_way_out(arrival, tick.certain);
  const double sigma = sigma_at(index_);
  tick.sigma = {std::llround(tick.certain ? sigma : std::max(sigma, std::abs(static_cast<double>(tick.late_by.ns))))};
  return tick;
}

/// What has been in doubt for long will not be made out: the line begins anew from here, whatever it was.
void ClockLine::look_for_a_way_out(const Arrival& arrival, bool certain) {
  if (certain || !doubted_since_ns_) {
    doubted_since_ns_.reset();
    if (!certain) doubted_since_ns_ = arrival.arrived_ns;
    return;
  }
  if (arrival.arrived_ns - *doubted_since_ns_ < std::max(kGiveUpNs, 24 * settings_.period.ns)) return;
  report({ClockEvent::Kind::restart, {arrival.arrived_ns}, 0, 0});
  ++restarts_;
  doubted_since_ns_ = arrival.arrived_ns;
  blocks_.clear();
  recent_.clear();
  past_drifts_.clear();
  change_.reset();
  suspect_from_.reset();
  slip_from_.reset();
  skipped_ = {};
  span_ = 1;
  since_begin_ = 1;
  prior_ = {0, settings_.drift_sigma_ppm * 1e3};
  calm_drifts_.fill({index_, prior_.slope, prior_.sigma});
  add(arrival);
  refit();
  remember(arrival);
}

void ClockLine::add(const Arrival& arrival) {
  const std::int64_t offset = offset_of(arrival);
  const std::int64_t id = floor_div(arrival.index, span_);
  if (!blocks_.empty() && blocks_.back().id >= id) {
    Block& block = blocks_.back();
    ++block.count;
    // Earlier relative to the line and not to its nominal slope, lest the drift prefer one end of the block.
    const double earlier = static_cast<double>(offset - block.offset_ns) -
                           fit_.slope * static_cast<double>((arrival.index - block.index) * settings_.period.ns) * 1e-9;
    if (earlier < 0 && arrival.index >= block.index) {
      block.index = arrival.index;
      block.offset_ns = offset;
    }
    return;
  }
  blocks_.push_back({id, arrival.index, offset, 1});
  if (blocks_.size() <= kBlocks) return;
  if (span_ >= full_span_) {
    blocks_.pop_front();
    return;
  }
  span_ *= 2;
  std::deque<Block> merged;
  for (const Block& block : blocks_) {
    const std::int64_t wide_id = floor_div(block.index, span_);
    if (merged.empty() || merged.back().id != wide_id) {
      merged.push_back({wide_id, block.index, block.offset_ns, block.count});
      continue;
    }
    Block& into = merged.back();
    into.count += block.count;
    const double rise = fit_.slope * static_cast<double>((block.index - into.index) * settings_.period.ns) * 1e-9;
    if (static_cast<double>(block.offset_ns - into.offset_ns) < rise) {
      into.index = block.index;
      into.offset_ns = block.offset_ns;
    }
  }
  blocks_ = std::move(merged);
}

std::vector<EdgePoint> ClockLine::points() const {
  std::vector<EdgePoint> points;
  points.reserve(blocks_.size());
  for (const Block& block : blocks_) {
    points.push_back({seconds_to(block.index), static_cast<double>(block.offset_ns - anchor_offset_ns_),
                      static_cast<double>(block.count)});
  }
  return points;
}

EdgeSettings ClockLine::edge_settings() const {
  // The least of many lie near the edge anyway; of single arrivals only the lower third is taken for near.
  const double used = span_ == 1 ? 0.35 : span_ == 2 ? 0.5 : span_ == 4 ? 0.65 : 0.8;
  return {used, static_cast<double>(settings_.resolution.ns)};
}

void ClockLine::refit() {
  anchor_index_ = blocks_.front().index;
  anchor_offset_ns_ = blocks_.front().offset_ns;
  fit_index_ = index_;
  const auto all = points();
  if (const auto fit = fit_edge(all, prior_, seconds_to(index_), edge_settings())) {
    fit_ = *fit;
    if (since_begin_ >= kRecent) judge_drift();
    if (index_ - calm_drifts_[1].index >= static_cast<std::int64_t>(kRecent)) {
      calm_drifts_[0] = calm_drifts_[1];
      calm_drifts_[1] = {index_, fit_.slope, fit_.slope_sigma};
    }
    return;
  }
  // Too few to know how much they jitter: anywhere within a period.
  fit_ = {};
  fit_.value_ns = all.front().y_ns;
  for (const EdgePoint& p : all) fit_.value_ns = std::min(fit_.value_ns, p.y_ns);
  fit_.value_sigma_ns = static_cast<double>(settings_.period.ns);
  fit_.spacing_ns = fit_.value_sigma_ns;
  fit_.slope = prior_.slope;
  fit_.slope_sigma = prior_.sigma;
}

}  // namespace birdseye
