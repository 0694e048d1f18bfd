#include "drivers/minibird/assembler.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace birdseye::drivers::minibird {

namespace {

ClockLine::Settings line_settings(Duration period) {
  ClockLine::Settings settings;
  settings.period = period;
  return settings;
}

}  // namespace

MeasurementAssembler::MeasurementAssembler(const StreamLayout& layout)
    : layout_(layout),
      period_(Duration::from_seconds(1.0 / layout.rate_hz)),
      parser_(layout),
      clock_line_(line_settings(period_)) {
  for (const BirdLayout& bird : layout_.birds) guards_.emplace_back(bird, layout_.plausibility);
}

std::vector<BirdGuard::Noise> MeasurementAssembler::noise() const {
  std::vector<BirdGuard::Noise> out;
  for (const BirdGuard& guard : guards_) out.push_back(guard.noise());
  return out;
}

void MeasurementAssembler::expect(const std::vector<BirdGuard::Noise>& noise) {
  for (std::size_t i = 0; i < std::min(noise.size(), guards_.size()); ++i) guards_[i].expect(noise[i]);
}

MiniBirdCounters MeasurementAssembler::counters() const {
  MiniBirdCounters counters = counters_;
  counters.phase_errors = parser_.phase_errors();
  counters.discarded_bytes = parser_.discarded_bytes();
  counters.lost_measurements = static_cast<std::uint64_t>(std::max<std::int64_t>(0, lost_));
  return counters;
}

void MeasurementAssembler::begin_anew() {
  if (last_tick_) clock_events_.push_back({ClockEvent::Kind::restart, last_tick_->time});
  parser_.reset();
  clock_line_ = ClockLine(line_settings(period_));
  cycle_.reset();
  last_begin_.reset();
  last_tick_.reset();
  arrivals_.clear();
}

DeviceTime MeasurementAssembler::began(const Cycle& cycle) const {
  // Bytes come no faster than the line carries them, and late by what nobody knows: the earliest that any of the
  // chunks since allows is the nearest to the truth.
  const std::int64_t byte_ns = std::int64_t{10} * 1'000'000'000 / layout_.baud;
  std::optional<DeviceTime> earliest;
  for (const Arrival& arrival : arrivals_) {
    if (arrival.end <= cycle.first_record) continue;
    const DeviceTime allowed = arrival.at - Duration{(arrival.end - cycle.first_record + cycle.before_it) * byte_ns};
    if (!earliest || allowed < *earliest) earliest = allowed;
  }
  return *earliest;
}

std::int64_t MeasurementAssembler::lost_before(const Cycle& cycle, DeviceTime began) const {
  if (!last_begin_ || !last_tick_) return 0;
  // The bytes between tell, if few of them were lost; the time tells, if this one is not late. What both say is safe:
  // that there were more, the clock line notices by itself.
  const auto cycle_length = static_cast<double>(cycle_bytes(layout_));
  const std::int64_t by_bytes =
      std::llround(static_cast<double>(cycle.first_record - cycle.before_it - *last_begin_) / cycle_length) - 1;
  const double periods = static_cast<double>((began - last_tick_->time).ns) / static_cast<double>(period_.ns);
  const std::int64_t by_time = std::llround(std::floor(periods + 0.3)) - 1;
  return std::max<std::int64_t>(0, std::min(by_bytes, by_time));
}

void MeasurementAssembler::finish(std::vector<Measurement>& out) {
  const DeviceTime start = began(*cycle_);
  const std::int64_t lost = lost_before(*cycle_, start);
  // After damage nobody knows how many measurements were lost but the clock line, and it only in time.
  const bool damaged = std::exchange(damaged_, false) || cycle_->damage != damage_seen_;
  damage_seen_ = cycle_->damage;
  const ClockLine::Tick tick = clock_line_.push(start, lost, damaged);
  for (const ClockEvent& event : clock_line_.take_events()) clock_events_.push_back(event);
  if (last_tick_) lost_ += tick.index - last_tick_->index - 1;
  last_tick_ = tick;
  last_begin_ = cycle_->first_record - cycle_->before_it;

  Measurement measurement;
  measurement.acquired = tick.time - layout_.delay;
  measurement.acquired_sigma = in_quadrature(tick.sigma, kWakeSigma);
  // An arrival near its tick bounds the tick's error, whatever is undecided about the count: its sigma says by how
  // much.
  measurement.time_certain = tick.certain || tick.sigma.ns <= period_.ns * 6 / 10;
  measurement.arrived = cycle_->arrived;
  for (std::size_t bird = 0; bird < layout_.birds.size(); ++bird) {
    BirdReading reading;
    if (const auto& record = cycle_->records[bird]) {
      reading =
          guards_[bird].judge(*record, measurement.acquired, measurement.acquired_sigma, measurement.time_certain);
    }
    ++counters_.doubted[static_cast<std::size_t>(reading.kind)];
    if (reading.kind == DoubtKind::senseless || reading.kind == DoubtKind::saturated) ++counters_.senseless_records;
    measurement.birds.push_back(std::move(reading));
  }
  out.push_back(std::move(measurement));
  ++counters_.measurements;
  cycle_.reset();
}

void MeasurementAssembler::take(Record record, DeviceTime arrived, std::vector<Measurement>& out) {
  const std::size_t bird = layout_.group_mode ? record.address - std::size_t{1} : 0;
  // The rest of that cycle was lost; after a loss, who knows which cycle a record is of.
  if (cycle_ && (bird <= cycle_->last_bird || record.phase_errors != cycle_->phase_errors)) finish(out);
  if (!cycle_) {
    std::size_t before_it = 0;
    for (std::size_t before = 0; before < bird; ++before) before_it += record_bytes(layout_, before);
    cycle_ = Cycle{record.begin, static_cast<std::int64_t>(before_it), arrived, {}, 0, record.phase_errors};
    cycle_->records.resize(layout_.birds.size());
  }
  cycle_->arrived = arrived;
  cycle_->last_bird = bird;
  cycle_->damage = record.phase_errors + record.discarded_bytes;
  cycle_->records[bird] = std::move(record);
  if (bird + 1 == layout_.birds.size()) finish(out);
}

std::vector<Measurement> MeasurementAssembler::push(const Chunk& chunk) {
  std::vector<Measurement> out;
  if (chunk.after_restart) {
    ++counters_.restarts;
    begin_anew();
  }
  if (chunk.after_line_error) {
    ++counters_.line_errors;
    if (cycle_) finish(out);
    parser_.reset();
    damaged_ = true;
  }
  received_ += static_cast<std::int64_t>(chunk.bytes.size());
  arrivals_.push_back({received_, chunk.arrived});
  // A cycle in hand began no more than a cycle ago.
  const auto far_back = received_ - static_cast<std::int64_t>(2 * cycle_bytes(layout_) + chunk.bytes.size());
  while (arrivals_.front().end < far_back) arrivals_.pop_front();
  for (Record& record : parser_.push(chunk.bytes)) take(std::move(record), chunk.arrived, out);
  return out;
}

}  // namespace birdseye::drivers::minibird
