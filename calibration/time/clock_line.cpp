#include "calibration/time/clock_line.hpp"

#include <algorithm>
#include <cmath>

namespace birdseye {
namespace {

constexpr std::size_t kBlocks = 64;
constexpr std::size_t kRecent = 96;
constexpr std::int64_t kDecidedAfterNs = 300'000'000;  // late for less may be one busy machine, however many arrivals
constexpr std::size_t kEarlyOf = 8;                    // within so many arrivals ...
constexpr std::size_t kEarlyConfirms = 3;  // ... so many early ones are a line that moved, fewer are bad stamps
/// An arrival may be this far under the line, for the line's own error has a tail of the exponential kind.
constexpr double kEarlySigmas = 9;
/// What chance explains only once in e^18 times (10^8) is not chance; once in e^9 it is not to be relied on.
constexpr double kDecided = 18, kDoubted = 9;
/// Two lines must be better than one by this (nats) to be a change of drift.
constexpr double kBend = 18;
/// A change less than this may be one of the drift.
constexpr double kSmallStepNs = 600e3;

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

std::size_t half_octave(double late_ns) {
  return static_cast<std::size_t>(std::clamp(2 * std::log2(std::max(late_ns, 1.0) * 1e-3), 0.0, 47.0));
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
  origin_ns_ = arrived.ns;
  prior_ = {0, settings_.drift_sigma_ppm * 1e3};
  calm_drifts_.fill({0, prior_.slope, prior_.sigma});
}

ClockLine::Tick ClockLine::push(DeviceTime arrived, std::int64_t lost) {
  if (index_ < 0) {
    restart(arrived);
  } else {
    index_ += 1 + std::max<std::int64_t>(0, lost);
  }
  return place(arrived);
}

ClockLine::Tick ClockLine::push_numbered(DeviceTime arrived, std::int64_t number) {
  if (index_ < 0 || number - first_number_ <= index_) {
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
      const double sigma = sigma_at(index_);
      const auto period = static_cast<double>(settings_.period.ns);
      // At or beyond this, it may be a later measurement than it is counted for.
      arrival.held = !numbered_ && arrival.late_ns > period - std::min(8 * sigma, 0.5 * period);
      if (!arrival.held) {
        release();
        add(arrival);
        if (blocks_.size() > 1 && blocks_.back().count == 1 && span_ == full_span_) look_for_bend();
      }
      remember(arrival);
      const bool held = arrival.held;
      const double doubt = look_for_late();
      certain = certain && doubt < kDoubted && (!held || doubt < 0);
      refit();
    }
  }
  Tick tick;
  const double line_ns = line_at(index_);
  tick.time = {origin_ns_ + index_ * settings_.period.ns + anchor_offset_ns_ + std::llround(line_ns)};
  tick.late_by = arrived - tick.time;
  tick.certain = certain && since_begin_ > settings_.slip_confirms;
  const double sigma = sigma_at(index_);
  tick.sigma = {std::llround(tick.certain ? sigma : std::max(sigma, std::abs(static_cast<double>(tick.late_by.ns))))};
  return tick;
}

/// What arrives so early is not kept, unless it goes on: then the line begins anew from there. True where it may not be
/// relied on.
bool ClockLine::look_for_early(const Arrival& arrival) {
  const double limit = -kEarlySigmas * sigma_at(arrival.index);
  if (arrival.late_ns >= limit || since_begin_ <= settings_.slip_confirms) return false;
  remember(arrival);
  recent_.back().held = true;
  std::size_t early = 0, first = recent_.size() - 1;
  const std::size_t from = recent_.size() > kEarlyOf ? recent_.size() - kEarlyOf : 0;
  double jump = 0;
  for (std::size_t i = recent_.size(); i-- > from;) {
    if (recent_[i].late_ns >= limit) continue;
    ++early;
    first = i;
    jump = std::min(jump, recent_[i].late_ns);
  }
  if (early >= kEarlyConfirms) begin_from(first, jump, true);
  return true;
}

/// How little chance alone explains that the latest arrivals are all late, in nats. Negative after it has been decided.
double ClockLine::look_for_late() {
  double least = recent_.back().late_ns, most_doubt = 0;
  std::size_t run = 0;
  for (std::size_t n = 1; n <= recent_.size(); ++n) {
    least = std::min(least, recent_[recent_.size() - n].late_ns);
    if (least <= 0) break;
    const double doubt = static_cast<double>(n) * doubt_of(least);
    if (doubt >= most_doubt) {
      most_doubt = doubt;
      run = n;
    }
  }
  if (most_doubt < kDecided || run < settings_.slip_confirms) return most_doubt;
  const std::size_t first = recent_.size() - run;
  if (recent_.back().arrived_ns - recent_[first].arrived_ns < kDecidedAfterNs) return most_doubt;
  double before = recent_[first].late_ns, after = recent_.back().late_ns;
  for (std::size_t i = 0; i < run / 2; ++i) before = std::min(before, recent_[first + i].late_ns);
  for (std::size_t i = run / 2; i < run; ++i) after = std::min(after, recent_[first + i].late_ns);
  least = std::min(before, after);
  const double spread = fit_.spacing_ns / static_cast<double>(run);
  // A machine that is behind and catches up, or falls behind further, has no new edge yet.
  if (std::abs(before - after) > 0.5 * least + 16 * spread) return most_doubt;
  const double period = true_period_ns(), periods = std::round((least - spread) / period);
  const double over = least - periods * period, sigma = sigma_at(index_);
  if (numbered_ || periods < 1 || over < -8 * sigma || over > std::min(0.4 * period, 7 * spread + 8 * sigma)) {
    begin_from(first, least - spread, true);
    return -1;
  }
  slip(run, static_cast<std::int64_t>(periods));
  // By a little more than a period: it is a slip by chance, or a step. The level is found anew.
  if (over > 3 * spread + 8 * sigma) begin_from(first, over, false);
  return -1;
}

/// -log of the share of arrivals that are so late: by the density at the edge, but no rarer than they have been seen.
double ClockLine::doubt_of(double late_ns) const {
  double later = 1;
  for (std::size_t i = half_octave(late_ns); i < late_counts_.size(); ++i) later += late_counts_[i];
  return std::min(late_ns / std::max(fit_.spacing_ns, 1.0), std::log((late_total_ + 2) / later));
}

void ClockLine::tally(double late_ns) {
  ++late_counts_[half_octave(late_ns)];
  if (++late_total_ < 8000) return;
  late_total_ /= 2;
  for (double& count : late_counts_) count /= 2;
}

/// An arrival on time shows that those held back were only late.
void ClockLine::release() {
  for (Arrival& arrival : recent_) {
    if (arrival.held && arrival.late_ns > 0) tally(arrival.late_ns);
    arrival.held = false;
  }
}

void ClockLine::remember(const Arrival& arrival) {
  if (!arrival.held && arrival.late_ns > 0) tally(arrival.late_ns);
  // What comes in one go after a pause tells of one delay and not of several.
  if (!recent_.empty() && arrival.late_ns > 0 && recent_.back().late_ns > 0 &&
      arrival.arrived_ns - recent_.back().arrived_ns < settings_.period.ns / 2) {
    if (arrival.late_ns < recent_.back().late_ns) recent_.back() = arrival;
    return;
  }
  recent_.push_back(arrival);
  if (recent_.size() > kRecent) recent_.pop_front();
}

void ClockLine::slip(std::size_t run, std::int64_t periods) {
  const std::size_t first = recent_.size() - run;
  const std::int64_t by_ns = periods * settings_.period.ns;
  const double less_late_ns = static_cast<double>(periods) * true_period_ns();
  report({ClockEvent::Kind::slip, {recent_[first].arrived_ns}, by_ns, 0});
  index_ += periods;
  for (std::size_t i = first; i < recent_.size(); ++i) {
    recent_[i].index += periods;
    recent_[i].late_ns -= less_late_ns;
    if (recent_[i].held) add(recent_[i]);
    recent_[i].held = false;
  }
}

/// Drops the line, keeps its drift, and begins again with the latest arrivals.
void ClockLine::begin_from(std::size_t first_recent, double jump_ns, bool is_event) {
  const bool large = !is_event || std::abs(jump_ns) > std::max(20 * sigma_at(index_), kSmallStepNs);
  const Arrival& start = recent_[first_recent];
  if (large) {
    if (is_event) report({ClockEvent::Kind::step, {start.arrived_ns}, std::llround(jump_ns), 0});
    change_.reset();
  } else if (!change_) {
    change_ = Change{start.index, calm_drifts_[0].slope, calm_drifts_[0].slope_sigma, sigma_at(start.index),
                     anchor_offset_ns_ + std::llround(line_at(start.index))};
  }
  ++restarts_;
  // The drift of before: the first arrivals after the jump may have bent the line.
  prior_ = {calm_drifts_[0].slope,
            large ? std::max(calm_drifts_[0].slope_sigma, 1e4) : settings_.drift_sigma_ppm * 1e3};
  calm_drifts_.fill({index_, prior_.slope, prior_.sigma});
  blocks_.clear();
  span_ = 1;
  since_begin_ = 0;
  recent_.erase(recent_.begin(), recent_.begin() + static_cast<std::ptrdiff_t>(first_recent));
  for (Arrival& arrival : recent_) {
    add(arrival);
    arrival.held = false;
    ++since_begin_;
  }
  refit();
  for (Arrival& arrival : recent_) {
    arrival.late_ns = static_cast<double>(offset_of(arrival) - anchor_offset_ns_) - line_at(arrival.index);
  }
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

void ClockLine::look_for_bend() {
  if (change_) explain_change();
  compare_drift();
  if (blocks_.size() < 16) return;
  const auto all = points();
  const std::span<const EdgePoint> whole(all);
  const double misfit = edge_misfit(whole, fit_.spacing_ns);
  for (const std::size_t latest : {std::size_t{8}, std::size_t{16}, std::size_t{32}}) {
    if (latest + 8 > whole.size()) break;
    const std::size_t earlier = whole.size() - latest;
    const double apart =
        edge_misfit(whole.first(earlier), fit_.spacing_ns) + edge_misfit(whole.subspan(earlier), fit_.spacing_ns);
    if (misfit - apart < kBend) continue;
    const auto before = fit_edge(whole.first(earlier), prior_, all[earlier].x_s, edge_settings());
    if (before) forget_before(earlier, before->slope, before->slope_sigma);
    return;
  }
}

/// The drift has changed: drops the blocks before that one, and remembers the line they made.
void ClockLine::forget_before(std::size_t block, double slope, double slope_sigma) {
  const auto all = points();
  const std::span<const EdgePoint> before(all);
  const double at_s = seconds_to(blocks_[block].index);
  const auto old = fit_edge(before.first(block), prior_, at_s, edge_settings());
  if (!change_ && old) {
    change_ = Change{blocks_[block].index, slope, slope_sigma, old->value_sigma_ns,
                     anchor_offset_ns_ + std::llround(old->value_ns)};
  }
  prior_ = {fit_.slope, settings_.drift_sigma_ppm * 1e3};
  blocks_.erase(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(block));
}

/// A change too small to be seen as a bend shows when the window has left it behind.
void ClockLine::compare_drift() {
  if (blocks_.size() < kBlocks || change_) {
    past_drifts_.clear();
    return;
  }
  const auto window = static_cast<std::int64_t>(kBlocks) * full_span_;
  const auto old = past_drifts_.empty() ? Drift{index_, 0, 0} : past_drifts_.front();
  if (old.index <= index_ - window) {
    const double turn = fit_.slope - old.slope;
    if (std::abs(turn) > 6 * std::hypot(fit_.slope_sigma, old.slope_sigma) +
                             5 * settings_.wander_ppm_per_s * 1e3 * settings_.window.seconds()) {
      past_drifts_.clear();
      forget_before(blocks_.size() - kBlocks / 4, old.slope, old.slope_sigma);
      return;
    }
    past_drifts_.pop_front();
  }
  if (past_drifts_.empty() || past_drifts_.back().index <= index_ - window / 8) {
    past_drifts_.push_back({index_, fit_.slope, fit_.slope_sigma});
  }
}

/// When enough has been seen after a change, says what it was.
void ClockLine::explain_change() {
  const double since_s = static_cast<double>((index_ - change_->index) * settings_.period.ns) * 1e-9;
  if (since_s < 0.3 * settings_.window.seconds() || blocks_.size() < 16) return;
  if (since_s > 1.5 * settings_.window.seconds()) {
    change_.reset();
    return;
  }
  const auto now = fit_edge(points(), prior_, seconds_to(change_->index), edge_settings());
  if (!now) return;
  const double turn = now->slope - change_->slope;
  const double jump = now->value_ns + static_cast<double>(anchor_offset_ns_ - change_->offset_ns);
  const DeviceTime at{origin_ns_ + change_->index * settings_.period.ns + change_->offset_ns};
  // The turn first: where the line was given up too late, a change of drift has become a jump as well.
  if (std::abs(turn) > 6 * std::hypot(now->slope_sigma, change_->slope_sigma)) {
    report({ClockEvent::Kind::drift_change, at, 0, turn * 1e-3});
  } else if (std::abs(jump) > 100e3 && std::abs(jump) > 6 * std::hypot(now->value_sigma_ns, change_->value_sigma_ns)) {
    report({ClockEvent::Kind::step, at, std::llround(jump), turn * 1e-3});
  } else {
    return;
  }
  change_.reset();
}

}  // namespace birdseye
