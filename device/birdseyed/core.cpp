#include "device/birdseyed/core.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "calibration/record/field_map_file.hpp"

namespace birdseye::device {

namespace {

using drivers::minibird::BirdReading;
using drivers::minibird::DoubtKind;
using drivers::minibird::Measurement;
using drivers::minibird::MiniBirdCounters;

constexpr Duration kDoubtToldEvery = Duration::from_ms(1000);
constexpr Duration kDoubtInStatusAfter = Duration::from_ms(100);  // a record that is lost now and then is none of it
constexpr Duration kClockFaultStays = Duration::from_ms(1000);    // after the last frame that shows it
constexpr Duration kClockFaultToldEvery = Duration::from_ms(10'000);
constexpr std::size_t kMostWaitingFrames = 16;  // 100 MB of 1080p, and over a quarter of a second

void add(MiniBirdCounters& sum, const MiniBirdCounters& more) {
  sum.measurements += more.measurements;
  sum.lost_measurements += more.lost_measurements;
  sum.phase_errors += more.phase_errors;
  sum.discarded_bytes += more.discarded_bytes;
  sum.line_errors += more.line_errors;
  sum.restarts += more.restarts;
  sum.senseless_records += more.senseless_records;
  for (std::size_t i = 0; i < sum.doubted.size(); ++i) sum.doubted[i] += more.doubted[i];
}

}  // namespace

Core::Core(CoreSettings settings)
    : settings_(std::move(settings)),
      birds_(settings_.bird_names.size()),
      scope_(settings_.pose),
      frame_clock_(settings_.frame_clock),
      calibration_(settings_.calibration, settings_.calibration_refused) {}

Core::Counters Core::counters() const {
  Counters counters;
  counters.tracker = counted_;
  if (assembler_) add(counters.tracker, assembler_->counters());
  counters.tracker.doubted[static_cast<std::size_t>(DoubtKind::unmapped)] += unmapped_;
  counters.frames = frames_seen_;
  counters.frames_lost = frames_lost_;
  counters.frames_repeated = frames_repeated_;
  counters.clock_events = clock_events_;
  if (assembler_) counters.tracker_drift_ppm = assembler_->drift_ppm();
  counters.spurious_strobe_edges = frame_clock_.spurious_strobe_edges();
  counters.camera_drift_ppm = frame_clock_.drift_ppm();
  counters.tracker_time_sigma_ms = time_sigma_.seconds() * 1e3;
  return counters;
}

std::vector<wire::Packet> Core::take(const RawEvent& event) {
  std::visit([this](const auto& what) { note(what); }, event);
  const DeviceTime now = time_of(event);
  if (const auto calibration = calibration_.take_change()) out_.push_back(wire::pack(*calibration, now));
  release_frames(now);
  publish_status(now);
  return std::exchange(out_, {});
}

void Core::note(const InstrumentChanged& changed) {
  board_.note(changed);
  calibration_.note(changed);
  const bool running = changed.state == InstrumentState::running;
  if (changed.instrument == Instrument::tracker) {
    if (running && settings_.field) field_fault_ = calibration::field_misfit(settings_.field_of, changed.identity);
    // What was half received will not be completed, and a unit that starts again has another beat.
    if (assembler_) {
      add(counted_, assembler_->counters());
      noise_ = assembler_->noise();
    }
    assembler_.reset();
    for (BirdState& bird : birds_) bird = {};
    if (running && changed.layout) {
      assembler_.emplace(*changed.layout);
      assembler_->expect(noise_);
    }
  }
  if (changed.instrument == Instrument::camera && running) {
    frame_clock_.restart(changed.rate_hz, changed.exposure);
    next_sequence_.reset();
    stamps_ahead_.reset();
    board_.set_clock_fault("");
  }
}

void Core::note(const TrackerBytes& bytes) {
  if (!assembler_) return;
  for (const Measurement& measurement : assembler_->push(bytes.chunk)) publish(measurement);
  tell(Instrument::tracker, assembler_->take_clock_events());
}

void Core::tell(Instrument instrument, const std::vector<ClockEvent>& events) {
  for (const ClockEvent& event : events) {
    ++clock_events_;
    out_.push_back(wire::pack(
        wire::ClockChange{event.at, name_of(instrument), to_string(event.kind), {event.by_ns}, event.by_ppm}));
  }
}

BirdReading Core::corrected(const BirdReading& reading) {
  const auto& pose = reading.pose;
  const bool refused = !settings_.field_refused.empty();
  if (!(refused || settings_.field) || !pose || !pose->position_mm || !pose->rotation) return reading;
  BirdReading out = reading;
  if (refused || !field_fault_.empty()) {
    ++unmapped_;
    out.pose.reset();
    out.doubt = refused ? "the map of the tracker's field is not used" : field_fault_;  // STATUS says why
    out.kind = DoubtKind::unmapped;
    return out;
  }
  const auto corrected = settings_.field->correct({*pose->rotation, *pose->position_mm});
  if (corrected) {
    out.pose->rotation = corrected->tracker_from_sensor.rotation();
    out.pose->position_mm = corrected->tracker_from_sensor.translation();
  } else {
    ++unmapped_;
    out.pose.reset();
    out.doubt = settings_.field->why_not(*pose->position_mm);
    out.kind = DoubtKind::unmapped;
  }
  return out;
}

void Core::note_doubt(std::size_t index, const BirdReading& reading, DeviceTime at) {
  BirdState& bird = birds_[index];
  if (reading.kind != bird.doubt) {
    bird = {reading.kind, reading.doubt, at, {}, false};
  }
  if (bird.doubt == DoubtKind::none) return;
  if (bird.told.ns == 0 || at - bird.told > kDoubtToldEvery) {
    bird.told = at;
    out_.push_back(wire::pack(wire::Doubt{at, settings_.bird_names[index], reading.doubt}));
  }
  bird.in_status = at - bird.since > kDoubtInStatusAfter;
}

void Core::publish(const Measurement& measurement) {
  time_sigma_ = measurement.acquired_sigma;
  const bool timed = measurement.time_certain && measurement.acquired_sigma <= settings_.pose.max_time_sigma;
  wire::Birds birds;
  birds.acquired = measurement.acquired;
  for (std::size_t i = 0; i < std::min(measurement.birds.size(), birds_.size()); ++i) {
    const BirdReading bird = corrected(measurement.birds[i]);
    note_doubt(i, bird, measurement.arrived);
    if (!timed || !bird.pose || !bird.pose->position_mm || !bird.pose->rotation) continue;
    const Transform<Tracker, Sensor> pose(*bird.pose->rotation, *bird.pose->position_mm);
    if (i == 0) scope_.push(measurement.acquired, measurement.acquired_sigma, pose);
    birds.birds.push_back({settings_.bird_names[i], pose});
  }
  if (!birds.birds.empty()) out_.push_back(wire::pack(birds, measurement.arrived, settings_.transforms));
}

void Core::note(const FrameCame& came) {
  const drivers::Frame& frame = came.frame;
  if (next_sequence_ && frame.sequence + 1 == *next_sequence_) {  // nothing new, whatever its pixels are
    ++frames_repeated_;
    return;
  }
  // A camera that counts from elsewhere has lost nothing; its clock begins anew too.
  if (next_sequence_ && frame.sequence > *next_sequence_ &&
      frame.sequence - *next_sequence_ < std::uint64_t{ClockLine::kMostMissing})
    frames_lost_ += frame.sequence - *next_sequence_;
  next_sequence_ = frame.sequence + 1;
  ++frames_seen_;
  calibration_.note_frame(frame.width_px, frame.height_px);
  frames_.push_back({frame, frame_clock_.time_of(frame), std::nullopt});
  correct_latency(frames_.back());
  const FrameClock::Time& time = frames_.back().time;
  if (time.ahead) {
    // Stamps that jitter would otherwise have it told anew with each frame.
    const bool first = !std::exchange(stamps_ahead_, frame.arrived);
    const bool alike = time.ahead->ns <= 2 * ahead_told_.ns && ahead_told_.ns <= 2 * time.ahead->ns;
    if (first || (!alike && frame.arrived > ahead_told_at_ + kClockFaultToldEvery)) {
      ahead_told_ = *time.ahead;
      ahead_told_at_ = frame.arrived;
      board_.set_clock_fault(time.reason);
    }
  } else if (stamps_ahead_ && frame.arrived > *stamps_ahead_ + kClockFaultStays) {
    stamps_ahead_.reset();
    board_.set_clock_fault("");
  }
  tell(Instrument::camera, frame_clock_.take_events());
  if (frames_.size() > kMostWaitingFrames) {  // the wait that is configured is longer than frames may be kept for
    publish(frames_.front());
    frames_.pop_front();
  }
}

void Core::note(const EdgesCame& came) {
  for (const drivers::GpioEdge& edge : came.edges) {
    if (edge.input == drivers::GpioInput::pedal) {
      out_.push_back(wire::pack(wire::Pedal{edge.active, edge.at}));
    } else {
      frame_clock_.take(edge);
    }
  }
}

/// A frame said to be of time t shows what the tracker measured at t less the latency.
void Core::correct_latency(TimedFrame& timed) const {
  const calibration::LatencyEntry* const latency = calibration_.latency();
  if (latency == nullptr) return;
  constexpr double kSigmasOf95 = 3.92;  // from one end of a normal distribution's 95 % to the other
  const double sigma_s = (latency->ci95_high_ms - latency->ci95_low_ms) / kSigmasOf95 * 1e-3;
  timed.latency = Duration::from_seconds(latency->offset_ms * 1e-3);
  timed.time.acquired = timed.time.acquired - *timed.latency;
  timed.time.sigma = Duration::from_seconds(std::hypot(timed.time.sigma.seconds(), sigma_s));
}

void Core::release_frames(DeviceTime now) {
  while (!frames_.empty()) {
    const auto& [frame, time, latency] = frames_.front();
    const auto newest = scope_.newest();
    const bool covered = newest && *newest >= time.acquired + settings_.pose.smoothing;
    if (!covered && settings_.pose_wait.ns > 0 && now < frame.arrived + settings_.pose_wait) return;
    publish(frames_.front());
    frames_.pop_front();
  }
}

void Core::publish(const TimedFrame& timed) {
  const auto& [frame, time, latency] = timed;
  wire::VideoFrame out;
  out.info.sequence = frame.sequence;
  out.info.acquired = time.acquired;
  out.info.acquired_sigma = time.sigma;
  out.info.arrived = frame.arrived;
  out.info.latency = latency;
  if (time.certain && time.sigma <= settings_.pose.max_time_sigma) {
    out.info.pose = scope_.at(time.acquired);
    if (out.info.pose.kind == PoseKind::refused && birds_[0].doubt != DoubtKind::none)
      out.info.pose.reason += ": " + birds_[0].why;
  } else {
    out.info.pose.reason = "when the frame was taken is not known well enough";
    if (!time.reason.empty()) out.info.pose.reason += ": " + time.reason;
  }
  out.info.frames_dropped = frames_lost_;
  out.width_px = frame.width_px;
  out.height_px = frame.height_px;
  out.rgb = frame.rgb;
  out_.push_back(wire::pack(out));
}

wire::Status Core::status() const {
  std::string text = board_.faults();
  for (std::size_t i = 0; i < birds_.size(); ++i) {
    if (birds_[i].in_status) text += (text.empty() ? "" : "; ") + settings_.bird_names[i] + ": " + birds_[i].why;
  }
  for (const std::string& fault : {calibration_.fault(), settings_.field_refused})
    if (!fault.empty()) text += (text.empty() ? "" : "; ") + fault;
  const bool ok = text.empty();
  if (!settings_.notice.empty()) text += (ok ? "" : "; ") + settings_.notice;
  return {ok, text};
}

void Core::publish_status(DeviceTime now) {
  const wire::Status status = this->status();
  if (status.text == status_text_) return;
  status_text_ = status.text;
  out_.push_back(wire::pack(status, now));
}

}  // namespace birdseye::device
