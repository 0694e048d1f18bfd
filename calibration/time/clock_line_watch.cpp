#include <algorithm>
#include <cmath>

#include "calibration/time/clock_line.hpp"

// How a clock line notices that it is no longer true: measurements lost, a step, a change of drift.

namespace birdseye {
namespace {

constexpr std::int64_t kStepAfterNs = 300'000'000;  // late for less may be one busy machine, however many arrivals
constexpr std::int64_t kSlipAfterNs = 150'000'000;  // the same, late by just whole periods
constexpr std::size_t kEarlyOf = 8;                 // within so many arrivals ...
constexpr std::size_t kEarlyConfirms = 3;  // ... so many early ones are a line that moved, fewer are bad stamps
/// An arrival may be this far under the line, for the line's own error has a tail of the exponential kind.
constexpr double kEarlySigmas = 9;
/// What chance explains only once in e^18 times (10^8) is not chance; where a loss is likely anyway, less is needed.
constexpr double kDecided = 18, kDecidedSuspect = 12, kByChance = 9;
constexpr std::size_t kSuspectConfirms = 4;
/// Two lines must be better than one by this (nats) to be a change of drift.
constexpr double kBend = 18;
/// A change less than this may be one of the drift.
constexpr double kSmallStepNs = 600e3;

std::size_t half_octave(double late_ns) {
  return static_cast<std::size_t>(std::clamp(2 * std::log2(std::max(late_ns, 1.0) * 1e-3), 0.0, 47.0));
}

}  // namespace

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
  if (early < kEarlyConfirms) return true;
  // Early by just as much as was thought to be lost a moment ago: it was not.
  const double spread = fit_.spacing_ns / static_cast<double>(early), period = true_period_ns();
  const double periods = std::round((spread - jump) / period), over = jump + periods * period;
  const double sigma = sigma_at(index_);
  if (!numbered_ && periods >= 1 && periods <= static_cast<double>(skipped_.periods) &&
      index_ - skipped_.index <= static_cast<std::int64_t>(kRecent) && over >= -8 * sigma &&
      over <= std::min(0.4 * period, 7 * spread + 8 * sigma)) {
    slip(recent_.size() - first, -static_cast<std::int64_t>(periods));
  } else {
    begin_from(first, jump, true);
  }
  return true;
}

ClockLine::Run ClockLine::run_of(std::size_t length) const {
  Run run;
  run.length = length;
  const auto least = [this](std::size_t begin, std::size_t end) {
    double late = recent_[begin].late_ns;
    for (std::size_t i = begin; i < end; ++i) late = std::min(late, recent_[i].late_ns);
    return late;
  };
  const std::size_t first = recent_.size() - length, middle = first + std::max<std::size_t>(1, length / 2);
  run.before_ns = least(first, middle);
  run.after_ns = middle < recent_.size() ? least(middle, recent_.size()) : run.before_ns;
  run.spread_ns = fit_.spacing_ns / static_cast<double>(length);
  run.doubt = static_cast<double>(length) * doubt_of(run.least_ns());
  return run;
}

/// The whole periods that the run is late by; 0 where it is late by something else.
std::int64_t ClockLine::periods_in(const Run& run) const {
  const double period = true_period_ns(), sigma = sigma_at(index_);
  const double periods = std::round((run.least_ns() - run.spread_ns) / period);
  const auto over = [&](double late_ns, double spread_ns) {
    const double more = late_ns - periods * period;
    return more >= -8 * sigma && more <= std::min(0.4 * period, 7 * spread_ns + 8 * sigma);
  };
  const bool whole = over(run.least_ns(), run.spread_ns) && over(run.before_ns, 2 * run.spread_ns) &&
                     over(run.after_ns, 2 * run.spread_ns);
  return whole ? static_cast<std::int64_t>(periods) : 0;
}

bool ClockLine::is_clear_slip(const Run& run, const Run& longest) const {
  const std::int64_t periods = periods_in(run);
  if (numbered_ || periods < 1) return false;
  const Arrival& first = recent_[recent_.size() - run.length];
  const bool suspect = suspect_from_ && first.index >= *suspect_from_;
  const std::size_t confirms = suspect ? std::min(kSuspectConfirms, settings_.slip_confirms) : settings_.slip_confirms;
  if (run.length < confirms) return false;
  if (!suspect && recent_.back().arrived_ns - first.arrived_ns < kSlipAfterNs) return false;
  // Neither chance nor one period less with chance.
  const double beyond = run.least_ns() - static_cast<double>(periods - 1) * true_period_ns();
  if (static_cast<double>(run.length) * doubt_of(beyond) < (suspect ? kDecidedSuspect : kDecided)) return false;
  // What was late before the run is late by chance, or after a loss before this one; else it is of a step.
  double least = recent_.back().late_ns;
  for (std::size_t n = run.length + 1; n <= longest.length; ++n) {
    least = std::min(least, recent_[recent_.size() - n].late_ns);
  }
  const auto others = static_cast<double>(longest.length - run.length);
  return others * doubt_of(least) < kByChance || least > may_be_the_next();
}

bool ClockLine::is_clear_step(const Run& run) const {
  const Arrival& first = recent_[recent_.size() - run.length];
  // By a little more than whole periods, it was a step that looked like a slip.
  const bool after_slip = slip_from_ && first.index >= *slip_from_;
  if (run.doubt < (after_slip ? kDecidedSuspect : kDecided) || run.length < settings_.slip_confirms) return false;
  if (recent_.back().arrived_ns - first.arrived_ns < kStepAfterNs) return false;
  // A machine that is behind and catches up, or falls behind further, has no new edge yet.
  return std::abs(run.before_ns - run.after_ns) <= 16 * run.spread_ns + 8 * sigma_at(index_);
}

/// How little chance alone explains that the latest arrivals are all late, in nats; 0 after it has been decided.
double ClockLine::look_for_late() {
  Run longest;
  double least = recent_.back().late_ns;
  double of_least = doubt_of(least);
  for (std::size_t n = 1; n <= recent_.size(); ++n) {
    if (const double late = recent_[recent_.size() - n].late_ns; late < least) {
      least = late;
      of_least = doubt_of(least);
    }
    if (least <= 0) break;
    const double doubt = static_cast<double>(n) * of_least;
    if (doubt >= longest.doubt) {
      longest.doubt = doubt;
      longest.length = n;
    }
  }
  if (longest.doubt < (suspect_from_ || slip_from_ ? kDecidedSuspect : kDecided)) return longest.doubt;
  longest = run_of(longest.length);
  for (std::size_t n = longest.length; n >= 1; --n) {
    const Run run = run_of(n);
    if (!is_clear_slip(run, longest)) continue;
    slip_from_ = recent_[recent_.size() - n].index + periods_in(run);
    slip(n, periods_in(run));
    return 0;
  }
  for (std::size_t n = longest.length; n >= settings_.slip_confirms; --n) {
    const Run run = run_of(n);
    if (!is_clear_step(run)) continue;
    begin_from(recent_.size() - n, run.least_ns() - run.spread_ns, true);
    return 0;
  }
  return longest.doubt;
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
  suspect_from_.reset();
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
  skipped_ = {index_, std::max<std::int64_t>(periods, 0)};
  suspect_from_.reset();
  for (std::size_t i = first; i < recent_.size(); ++i) {
    recent_[i].index += periods;
    recent_[i].late_ns -= less_late_ns;
    if (recent_[i].held) add(recent_[i]);
    recent_[i].held = false;
  }
  // Arrivals before this run that were held back belong to an earlier loss, which this slip has overtaken. Nobody knows
  // which measurements they are: drop them.
  std::size_t keep = first;
  while (keep > 0 && recent_[keep - 1].held) --keep;
  recent_.erase(recent_.begin() + static_cast<std::ptrdiff_t>(keep),
                recent_.begin() + static_cast<std::ptrdiff_t>(first));
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
  // Keep the drift from before the jump: the first arrivals after it may have bent the line. Several jumps soon after
  // each other are one drift that the line has not learnt.
  const bool again = jumped_at_ && (index_ - *jumped_at_) * settings_.period.ns < settings_.window.ns / 4;
  if (large) jumped_at_ = index_;
  prior_ = {calm_drifts_[0].slope,
            large && !again ? std::max(calm_drifts_[0].slope_sigma, 1e4) : settings_.drift_sigma_ppm * 1e3};
  calm_drifts_.fill({index_, prior_.slope, prior_.sigma});
  slip_from_.reset();
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

/// A drift that no clock has, however the line came to it: told once.
void ClockLine::judge_drift() {
  const double most = 4 * settings_.drift_sigma_ppm * 1e3, drift = std::abs(fit_.slope);
  const bool impossible = drift - 6 * fit_.slope_sigma > most;
  if (impossible && !impossible_)
    report({ClockEvent::Kind::drift_change, {origin_ns_ + index_ * settings_.period.ns}, 0, fit_.slope * 1e-3});
  impossible_ = impossible || (impossible_ && drift > most / 2);
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
