#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/time/clock_line.hpp"
#include "drivers/minibird/bird_guard.hpp"
#include "drivers/minibird/measurement.hpp"
#include "drivers/minibird/record_parser.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

/// Bytes of a stream -> measurements: finds the records, puts those of one cycle together, gives them regular times and
/// withholds the poses that cannot be. Pure: the same chunks give the same measurements.
class MeasurementAssembler {
 public:
  explicit MeasurementAssembler(const StreamLayout& layout);

  /// What the birds' noise was like, by address; and for a stream that begins, what it was before.
  [[nodiscard]] std::vector<BirdGuard::Noise> noise() const;
  void expect(const std::vector<BirdGuard::Noise>& noise);

  /// The measurements that these bytes complete, oldest first. A measurement of which records are missing is complete
  /// when a record of the next one has come.
  std::vector<Measurement> push(const Chunk& chunk);
  [[nodiscard]] MiniBirdCounters counters() const;
  /// By how much the unit's true period is longer than the nominal one.
  [[nodiscard]] double drift_ppm() const { return clock_line_.drift_ppm(); }
  /// Where the unit's beat did what jitter does not, since the last call: steps, losses that only time showed, changes
  /// of drift, restarts.
  std::vector<ClockEvent> take_clock_events() { return std::exchange(clock_events_, {}); }

 private:
  struct Arrival {
    std::int64_t end;  ///< bytes of the stream up to here had come
    DeviceTime at;
  };
  struct Cycle {
    std::int64_t first_record;  ///< where in the stream the first record of the cycle begins that came
    std::int64_t before_it;     ///< bytes of the birds before that one
    DeviceTime arrived;
    std::vector<std::optional<Record>> records;
    std::size_t last_bird = 0;
    std::uint64_t phase_errors = 0;  ///< of the parser when the cycle's first record was whole
    std::uint64_t damage = 0;        ///< its errors and discarded bytes when the last was
  };

  void take(Record record, DeviceTime arrived, std::vector<Measurement>& out);
  void finish(std::vector<Measurement>& out);
  void begin_anew();
  [[nodiscard]] DeviceTime began(const Cycle& cycle) const;
  [[nodiscard]] std::int64_t lost_before(const Cycle& cycle, DeviceTime began) const;

  StreamLayout layout_;
  Duration period_;
  RecordParser parser_;
  ClockLine clock_line_;
  std::vector<BirdGuard> guards_;
  std::deque<Arrival> arrivals_;  ///< the last few, oldest first
  std::int64_t received_ = 0;     ///< bytes, since the stream began
  std::optional<Cycle> cycle_;
  std::optional<std::int64_t> last_begin_;  ///< of the cycle before, where its first byte is or would be
  std::optional<ClockLine::Tick> last_tick_;
  std::int64_t lost_ = 0;
  bool damaged_ = false;           ///< by a line error since the last measurement
  std::uint64_t damage_seen_ = 0;  ///< Cycle::damage of the last measurement
  std::vector<ClockEvent> clock_events_;
  MiniBirdCounters counters_;
};

}  // namespace birdseye::drivers::minibird
