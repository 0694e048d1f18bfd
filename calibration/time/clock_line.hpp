#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "calibration/time/clock.hpp"
#include "calibration/time/edge_fit.hpp"

namespace birdseye {

/// What happened to a clock, other than jitter.
struct ClockEvent {
  enum class Kind {
    step,          ///< the delay jumped by by_ns
    slip,          ///< measurements were lost unseen (or came twice): by_ns is a whole number of periods
    drift_change,  ///< the rate changed by by_ppm
    restart,       ///< the count began anew: what was known of the line is dropped
  };
  Kind kind = Kind::step;
  DeviceTime at;  ///< the first arrival that shows it
  std::int64_t by_ns = 0;
  double by_ppm = 0;
};
const char* to_string(ClockEvent::Kind kind);

/// Sigma to add to times that a program stamps once the kernel has woken it. Waking always takes something, 0.05 to 0.2
/// ms where it was measured (docs/clocks.md), and no clock line can tell that from delay.
inline constexpr Duration kWakeSigma{100'000};

/// Finds the regular times of a periodic measurement. Arrivals are late by a delay that is never negative and jitters;
/// the earliest arrivals lie on a line, and that lower edge is the clock. Its level and its slope (the instrument's
/// drift) are estimated, with a sigma. Bounded in memory and in work per arrival; exact to the ns for days.
class ClockLine {
 public:
  struct Settings {
    Duration period;  ///< nominal
    Duration window = Duration::from_ms(20'000);
    std::size_t slip_confirms = 8;   ///< how many late arrivals, apart in time, it takes at least to believe in a loss
    double drift_sigma_ppm = 300;    ///< what is expected of the nominal period
    double wander_ppm_per_s = 0.02;  ///< how much the drift may change unnoticed within the window
    Duration resolution{1000};       ///< of arrivals
  };
  struct Tick {
    DeviceTime time;         ///< on the line
    Duration sigma;          ///< of time: 68 % of ticks are this close; in doubt, as much as the arrival is late
    Duration late_by;        ///< this arrival behind its tick
    std::int64_t index = 0;  ///< of the measurement, counting those that were lost
    bool certain = false;    ///< false while measurements may be missing or the line may have moved, and at the start
  };

  explicit ClockLine(const Settings& settings);

  /// Takes the next arrival; `lost` measurements before it are known to be missing. `perhaps_more`: there are signs
  /// that more than those are missing; lateness by whole periods is then believed sooner.
  Tick push(DeviceTime arrived, std::int64_t lost = 0, bool perhaps_more = false);
  /// An arrival with the sender's own count, which leaves no doubt about losses. A count that does not grow, or grows
  /// by more than kMostMissing at once, is a restart.
  static constexpr std::int64_t kMostMissing = 1'000'000;
  Tick push_numbered(DeviceTime arrived, std::int64_t index);

  /// By how much the true period is longer than the nominal one.
  [[nodiscard]] double drift_ppm() const { return fit_.slope * 1e-3; }
  [[nodiscard]] double drift_sigma_ppm() const;
  /// What happened since the last call; the oldest are dropped beyond 64.
  std::vector<ClockEvent> take_events();
  /// Times the line had to be begun anew: steps and restarts.
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

 private:
  static constexpr std::size_t kBlocks = 64, kRecent = 144;

  struct Arrival {
    std::int64_t index = 0, arrived_ns = 0;
    double late_ns = 0;  ///< behind the line when it came
    bool held = false;   ///< not yet on the line, for it may be of a later measurement
  };
  struct Block {
    std::int64_t id = 0, index = 0, offset_ns = 0, count = 0;  ///< index and offset of its earliest arrival
  };
  /// A run of the latest arrivals, all of them late.
  struct Run {
    std::size_t length = 0;
    double doubt = 0;                    ///< how little chance explains it, in nats
    double before_ns = 0, after_ns = 0;  ///< the least late of its first half, and of its second
    double spread_ns = 0;                ///< what the least of so many is late by on average
    [[nodiscard]] double least_ns() const { return before_ns < after_ns ? before_ns : after_ns; }
  };
  struct Skip {
    std::int64_t index = 0, periods = 0;
  };
  struct Change {
    std::int64_t index = 0;  ///< where the line was given up
    double slope = 0, slope_sigma = 0, value_sigma_ns = 0;
    std::int64_t offset_ns = 0;  ///< of the line given up
  };

  struct Drift {
    std::int64_t index = 0;
    double slope = 0, slope_sigma = 0;
  };

  void restart(DeviceTime arrived);
  Tick place(DeviceTime arrived);
  [[nodiscard]] std::int64_t offset_of(const Arrival& arrival) const;
  [[nodiscard]] double seconds_to(std::int64_t index) const;
  [[nodiscard]] double true_period_ns() const;
  [[nodiscard]] double line_at(std::int64_t index) const;  ///< relative to the anchor
  [[nodiscard]] double sigma_at(std::int64_t index) const;
  [[nodiscard]] double may_be_the_next() const;
  [[nodiscard]] double doubt_of(double late_ns) const;
  [[nodiscard]] std::vector<EdgePoint> points() const;
  [[nodiscard]] EdgeSettings edge_settings() const;
  void add(const Arrival& arrival);
  void refit();
  void remember(const Arrival& arrival);
  void look_for_a_way_out(const Arrival& arrival, bool certain);
  void tally(double late_ns);
  void release();
  bool look_for_early(const Arrival& arrival);
  double look_for_late();
  [[nodiscard]] Run run_of(std::size_t length) const;
  [[nodiscard]] std::int64_t periods_in(const Run& run) const;
  [[nodiscard]] bool is_clear_slip(const Run& run, const Run& longest) const;
  [[nodiscard]] bool is_clear_step(const Run& run) const;
  void slip(std::size_t run, std::int64_t periods);
  void begin_from(std::size_t first_recent, double jump_ns, bool is_event);
  void look_for_bend();
  void forget_before(std::size_t block, double slope, double slope_sigma);
  void compare_drift();
  void judge_drift();
  void explain_change();
  void report(ClockEvent event);

  Settings settings_;
  bool numbered_ = false;
  std::int64_t origin_ns_ = 0, index_ = -1, first_number_ = 0;
  std::int64_t anchor_index_ = 0, anchor_offset_ns_ = 0;  ///< doubles are relative to these
  std::int64_t span_ = 1, full_span_ = 1;                 ///< arrivals in a block, now and at most
  std::deque<Block> blocks_;
  std::deque<Arrival> recent_;
  std::size_t since_begin_ = 0;
  std::optional<std::int64_t> doubted_since_ns_;  ///< the first of the arrivals of late that were not certain
  EdgePrior prior_;
  EdgeFit fit_;
  std::int64_t fit_index_ = 0;
  std::array<double, 48> late_counts_{};  ///< by half octaves of lateness
  double late_total_ = 0;
  std::array<Drift, 2> calm_drifts_{};  ///< of some 100 and 200 arrivals ago
  std::deque<Drift> past_drifts_;
  std::optional<Change> change_;
  std::optional<std::int64_t> jumped_at_;     ///< the index of the newest large jump
  bool impossible_ = false;                   ///< the drift, which has been told
  std::optional<std::int64_t> suspect_from_;  ///< where more may have been lost than is known
  std::optional<std::int64_t> slip_from_;     ///< where a loss was last seen by the time alone
  Skip skipped_;                              ///< the newest loss that was told or seen
  std::deque<ClockEvent> events_;
  std::uint64_t restarts_ = 0;
};

}  // namespace birdseye
