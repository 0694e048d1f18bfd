#include "hw-sim/operation/operation_laws.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/base/units.hpp"
#include "device/wire/json.hpp"
#include "host/texts/texts.hpp"
#include "hw-sim/faults/fault_table.hpp"
#include "hw-sim/operation/operation_window.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kSigmas = 6;
constexpr double kQuantum_mm = 0.06;     // half a count in 914 mm, per axis, and rounding
constexpr double kQuantum_deg = 0.02;    // of a matrix's words, and rounding
constexpr double kTrackHolds_s = 0.1;    // a reading after a longer hole is believed once the next agrees
constexpr double kNoiseIsKnown_s = 2.5;  // after a bird's first record
constexpr double kTimeLimit_s = 0.010;   // of [pose] max_time_sigma_ms: what TDATA promises
constexpr double kMostBeyond = 0.001;    // of whole overlays, by more than the latter
constexpr std::uint64_t kFewestJudged = 10'000;
constexpr double kNamedWithin_s = 2, kOverWithin_s = 2;
constexpr double kAlone_s = 5;     // from another fault's end to this one's begin, and after it
constexpr double kMatches_s = 30;  // that the first matching of the CT takes until it holds all that it needs
constexpr std::size_t kMostGrowth = std::size_t{16} << 20;
constexpr std::size_t kMostBroken = 100;  // that are told

double speed_mm_s(const OperationTruth& truth, std::size_t bird, double at_s) {
  constexpr double kStep_s = 0.01;
  double most = 0;
  for (int step = -2; step < 2; ++step) {
    const auto from = truth.tracker_from_sensor(bird, at_s + step * kStep_s).translation();
    const auto to = truth.tracker_from_sensor(bird, at_s + (step + 1) * kStep_s).translation();
    most = std::max(most, (to - from).norm() / kStep_s);
  }
  return most;
}

double degrees_between(const Eigen::Matrix3d& one, const Eigen::Matrix3d& other) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(one.transpose() * other)).angle() * kDegPerRad;
}

/// What birds are fixed on, or all of them through the transmitter, against the rest of the world.
bool moves_birds(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::transmitter_bumped:
    case FaultKind::bed_tilted:
    case FaultKind::patient_moved:
    case FaultKind::reference_moved:
      return true;
    default:
      return false;
  }
}

/// On the operation's clock. Infinite: it lasts for good.
double end_of(const Fault& fault) {
  if (fault.for_s) return fault.at_s + *fault.for_s;
  if (fault.kind == FaultKind::resected) return fault.at_s + takes_s(fault);  // what is cut lies still
  const bool once = fault_spec(fault_name(fault.kind))->without_end == WithoutEnd::once;
  return once ? fault.at_s : std::numeric_limits<double>::infinity();
}

std::size_t bird_of(const std::string& name) {
  return name == "scope" ? 0 : name == "pointer" ? 1 : 2;
}

}  // namespace

OperationLaws::OperationLaws(const OperationTruth& truth, const FaultScript& faults, ExposedNs exposed_ns,
                             std::int64_t zero_ns)
    : truth_(truth),
      exposed_ns_(std::move(exposed_ns)),
      zero_ns_(zero_ns),
      doubts_(truth, zero_ns),
      begins_at_board_(truth.at_board(0)) {
  for (const FaultTarget target : kFaultTargets) {
    for (const Fault& fault : faults.of(target)) {
      const FaultSigns signs = target == FaultTarget::world ? FaultSigns{} : signs_of(fault, target);
      const double own_end_s = end_of(fault);
      spans_.push_back({fault, target, signs, fault.at_s, own_end_s + signs.own_s, own_end_s, true, {}, {}, {}, {}});
      ++figures_.by_fault[name_of(spans_.back())].befell;
    }
  }
  for (Span& span : spans_) {
    for (const Span& other : spans_) {
      const bool moves_no_bird = other.of == FaultTarget::world && !moves_birds(other.fault);
      if (&other == &span || other.signs.aside || moves_no_bird) continue;
      const bool together = other.begins_s < span.ends_s && other.ends_s > span.begins_s;
      if (together && span.signs.shifts_bytes && other.signs.shifts_bytes) span.signs.extra_mm = kUnseenChange_mm;
      // The first record of a frozen bird that gets through is like one of a hand that stopped in the hole before it.
      const bool loses = other.signs.shifts_bytes || other.fault.kind == FaultKind::lost_record;
      // Until its noise is known, eight records that are the same tell that it is frozen, and then three.
      const bool is_new = starts_appliance(other.fault.kind) && other.begins_s < span.begins_s &&
                          span.begins_s < other.ends_s + kNoiseIsKnown_s;
      if (span.fault.kind == FaultKind::frozen_pose && ((together && loses) || is_new))
        span.signs.extra_s = kTrackHolds_s;
      if (other.begins_s < span.ends_s + kAlone_s && other.ends_s > span.begins_s - kAlone_s) span.alone = false;
    }
  }
  figures_.faults = spans_.size();
  const bool referenced = truth.birds() > 2;
  for (const Fault& fault : faults.of(FaultTarget::world)) {
    const bool of_scope = fault.kind == FaultKind::scope_turned || fault.kind == FaultKind::lens_zoomed;
    const bool of_patient = moves_birds(fault) && !referenced;
    if (!of_scope && !of_patient) continue;
    moves_.push_back({fault.at_s, fault.at_s + takes_s(fault), of_patient});
    if (!fault.for_s) continue;
    const double back_s = fault.at_s + *fault.for_s;
    moves_.push_back({back_s, back_s + takes_s(fault), of_patient});
  }
  std::ranges::sort(moves_, {}, &Move::begins_s);
  if (referenced) expect_slips();
}

bool OperationLaws::is_quiet(const Span& span, double at_s) const {
  constexpr double kApart_s = 1;
  return std::ranges::none_of(spans_, [&](const Span& other) {
    if (&other == &span || other.signs.aside || other.of == FaultTarget::camera) return false;
    if (other.of == FaultTarget::world) return moves_birds(other.fault) && changes_about(other, at_s);
    return at_s > other.begins_s - kApart_s && at_s < other.ends_s + kApart_s;
  });
}

/// A slip that is slower, or shorter, is told from a patient who moves by nobody (OVL-46).
void OperationLaws::expect_slips() {
  constexpr double kFar_mm = 8, kQuickly_s = 0.1;  // twice as far as the window sees, within as long
  std::vector<std::pair<double, double>> slips;
  for (const Span& span : spans_) {
    const Fault& fault = span.fault;
    if (fault.kind != FaultKind::reference_moved || fault.value("mm") < kFar_mm || takes_s(fault) > kQuickly_s)
      continue;
    std::vector<double> begins_s{fault.at_s};
    if (fault.for_s) begins_s.push_back(fault.at_s + *fault.for_s);
    for (const double begin_s : begins_s) {
      if (is_quiet(span, begin_s)) {
        slips.emplace_back(begin_s, begin_s + takes_s(fault));
      } else {
        // What hides it may take the poses away by which it would be seen before the frames are drawn.
        moves_.push_back({begin_s, begin_s + takes_s(fault), false});
      }
    }
  }
  std::ranges::sort(moves_, {}, &Move::begins_s);
  std::ranges::sort(slips);
  for (const auto& [begin_s, end_s] : slips) doubts_.come_off(begin_s, end_s);
}

std::string OperationLaws::name_of(const Span& span) {
  return fmt::format("{} {}", target_name(span.of), fault_name(span.fault.kind));
}

void OperationLaws::break_law(double at_s, const char* law, std::string what) {
  if (broken_.size() < kMostBroken) broken_.push_back({at_s, law, std::move(what)});
}

bool OperationLaws::changes_about(const Span& span, double at_s) {
  const auto changes = [&](double change_s) {
    return at_s > change_s - kLinger_s && at_s < change_s + takes_s(span.fault) + kLinger_s;
  };
  return changes(span.begins_s) || changes(span.ends_s);
}

/// own_mm: 6 sigma of what the pose says of its place; time_s: 6 sigma of its time.
void OperationLaws::judge_pose(const char* of, std::size_t bird, const Transform<Tracker, Sensor>& told, double true_s,
                               double now_s, double own_mm, double time_s) {
  double extra_mm = 0, extra_s = 0;
  for (const Span& span : spans_) {
    if (true_s < span.begins_s - kLinger_s || true_s > span.ends_s + kLinger_s) continue;
    if (span.signs.lies) return;
    // A hand does not move like a transmitter that is pushed: what is made of samples about the push is off.
    if (moves_birds(span.fault) && changes_about(span, true_s)) return;
    extra_mm += span.signs.extra_mm;
    extra_s += span.signs.extra_s;
  }
  const double noise_mm = kSigmas * OperationTruth::kNoise.position_mm * std::sqrt(3.0) + kQuantum_mm;
  const double off_mm = (told.translation() - truth_.tracker_from_sensor(bird, true_s).translation()).norm();
  if (off_mm < noise_mm / 2) return;  // good, however slowly it moves
  const double may_mm = noise_mm + own_mm + extra_mm + speed_mm_s(truth_, bird, true_s) * (time_s + extra_s);
  figures_.worst_pose = std::max(figures_.worst_pose, off_mm / may_mm);
  if (off_mm > may_mm)
    break_law(now_s, "pose", fmt::format("{} is {:.1f} mm off where it may be {:.1f}", of, off_mm, may_mm));
}

/// Of a bird's pose as it is published; of a frame's nothing is said of how well it is turned.
void OperationLaws::judge_turn(const wire::Bird& bird, double true_s, double now_s) {
  double time_s = kTimeLimit_s;
  for (const Span& span : spans_) {
    // Only a few of its records tell that it is frozen.
    if (span.fault.kind == FaultKind::frozen_pose && true_s > span.begins_s && true_s < span.ends_s + kLinger_s)
      time_s = kTrackHolds_s;
    if (moves_birds(span.fault)) {
      if (changes_about(span, true_s)) return;
      continue;
    }
    const bool frozen = span.fault.kind == FaultKind::frozen_pose;
    if (frozen || (!span.signs.lies && span.signs.extra_mm == 0 && span.signs.extra_s == 0)) continue;
    if (true_s > span.begins_s - kLinger_s && true_s < span.ends_s + kLinger_s) return;
  }
  const std::size_t number = bird_of(bird.name);
  const auto truth = [&](double at_s) { return truth_.tracker_from_sensor(number, at_s).rotation(); };
  const double off_deg = degrees_between(truth(true_s), bird.tracker_from_sensor.rotation());
  const double noise_deg = kSigmas * std::sqrt(3.0) * OperationTruth::kNoise.angle_deg + kQuantum_deg;
  if (off_deg < noise_deg) return;  // good, however slowly it turns
  // As speed_mm_s has it.
  constexpr double kStep_s = 0.01;
  double most_deg_s = 0;
  for (int step = -2; step < 2; ++step)
    most_deg_s = std::max(
        most_deg_s, degrees_between(truth(true_s + step * kStep_s), truth(true_s + (step + 1) * kStep_s)) / kStep_s);
  const double may_deg = noise_deg + most_deg_s * time_s;
  if (off_deg > may_deg)
    break_law(now_s, "pose",
              fmt::format("{} is turned by {:.2f} degrees where it may be by {:.2f}", bird.name, off_deg, may_deg));
}

void OperationLaws::take(const wire::Birds& birds, double now_s) {
  for (const wire::Bird& bird : birds.birds) {
    ++figures_.poses;
    judge_turn(bird, at_s(birds.acquired.ns), now_s);
    judge_pose(bird.name.c_str(), bird_of(bird.name), bird.tracker_from_sensor, at_s(birds.acquired.ns), now_s, 0,
               kTimeLimit_s);
    for (Span& span : spans_) {
      if (now_s > span.ends_s) span.birds_again.set(bird_of(bird.name));
    }
  }
  for (Span& span : spans_) {
    if (!span.poses_again_s && span.birds_again.count() == truth_.birds()) span.poses_again_s = now_s;
  }
}

void OperationLaws::take(const wire::VideoFrame& frame, double now_s) {
  ++figures_.frames;
  whole_picture_ = frame.width_px == truth_.lens(now_s).width_px;
  for (Span& span : spans_) {
    if (span.signs.half_size && now_s >= span.begins_s && !span.named_s && !whole_picture_) span.named_s = now_s;
  }
  const PoseAnswer& pose = frame.info.pose;
  if (!pose.tracker_from_sensor) return;
  ++figures_.frames_posed;
  for (Span& span : spans_) {
    if (now_s > span.ends_s && !span.frames_again_s) span.frames_again_s = now_s;
  }
  // By the time that is stamped: that the stamp is right is the camera's to say.
  judge_pose("a frame's pose", 0, *pose.tracker_from_sensor, at_s(frame.info.acquired.ns), now_s,
             kSigmas * pose.position_sigma_mm * std::sqrt(3.0),
             kSigmas * std::hypot(frame.info.acquired_sigma.seconds(), pose.time_sigma.seconds()));
}

void OperationLaws::name(double now_s, const std::string& words) {
  for (Span& span : spans_) {
    if (now_s < span.begins_s || span.named_s) continue;
    for (const std::string& sign : span.signs.words)
      if (words.find(sign) != std::string::npos) span.named_s = now_s;
  }
}

void OperationLaws::take(const wire::Health& health, double now_s) {
  for (const wire::InstrumentHealth& instrument : health.instruments)
    if (instrument.state != "running") name(now_s, instrument.text);
  const nlohmann::json now(health);
  for (Span& span : spans_) {
    if (now_s < span.begins_s || span.named_s || span.signs.counters.empty() || !before_) continue;
    const nlohmann::json before(*before_);
    for (const std::string& counter : span.signs.counters)
      if (now.at(counter).get<double>() > before.at(counter).get<double>()) span.named_s = now_s;
  }
  before_ = health;
}

void OperationLaws::take(const wire::Event& event, HostTime now) {
  const double now_s = at_s(now.ns);
  doubts_.take(event, now_s);
  if (const auto* const birds = std::get_if<wire::Birds>(&event)) take(*birds, now_s);
  if (const auto* const frame = std::get_if<wire::VideoFrame>(&event)) take(*frame, now_s);
  if (const auto* const health = std::get_if<wire::Health>(&event)) take(*health, now_s);
  if (const auto* const status = std::get_if<wire::Status>(&event); status != nullptr && !status->ok)
    name(now_s, status->text);
  if (const auto* const doubt = std::get_if<wire::Doubt>(&event)) name(now_s, doubt->why);
  if (std::holds_alternative<wire::ClockChange>(event)) {
    for (Span& span : spans_) {
      if (now_s >= span.begins_s && !span.named_s && std::ranges::count(span.signs.counters, "clock_events") > 0)
        span.named_s = now_s;
    }
  }
}

void OperationLaws::take(const host::OperationView& view, std::size_t checks, HostTime now) {
  using host::LiveStep;
  // Or the patient is registered anew: what was touched is never taken up.
  const double now_s = at_s(now.ns);
  // The calibration's doubt: what is over the picture may be another reason that speaks against the overlay too.
  if (const host::StepNote& calibrated = view.note(LiveStep::calibrate); calibrated.done)
    judge_accusation(calibrated.doubt == host::words("why_video_differs"), now_s);
  registered_ = view.note(LiveStep::fiducials).done;
  if (view.deforming && !std::exchange(has_matched_, true)) settles_s_ = std::max(settles_s_, now_s + kMatches_s);
  if (unwatched_to_s_ && now_s > *unwatched_to_s_ && (view.unconfirmed || !registered_)) unwatched_to_s_.reset();
  if (checks_when_opened_ && (checks > *checks_when_opened_ || !view.touches.empty())) checks_when_opened_.reset();
  judge_calibration_kept(view, now_s);
  judge_registration_kept(view, now_s);
}

void OperationLaws::take(std::span<const QueueFill> queues, HostTime now) {
  const auto judge = [&](const QueueFill& queue, std::size_t held, std::size_t most, const char* of) {
    if (held > most)
      break_law(at_s(now.ns), "queues", fmt::format("{}: {} {} wait, of at most {}", queue.queue, held, of, most));
    if (held > 0)
      figures_.fullest_queue = std::max(figures_.fullest_queue, static_cast<double>(held) / static_cast<double>(most));
  };
  for (const QueueFill& queue : queues) {
    judge(queue, queue.values, queue.most_values, "values");
    judge(queue, queue.bytes, queue.most_bytes, "bytes");
  }
}

void OperationLaws::take_memory(std::size_t bytes, HostTime now) {
  const double now_s = at_s(now.ns);
  if (now_s < settles_s_) {
    most_bytes_ = std::max(most_bytes_, bytes);
  } else if (bytes > most_bytes_ + kMostGrowth) {
    break_law(now_s, "memory", fmt::format("{} bytes are held, {} until {:.0f} s", bytes, most_bytes_, settles_s_));
    most_bytes_ = bytes;
  }
}

void OperationLaws::judge(const Span& span, double until_s) {
  const std::string name = fmt::format("{} at {:.3f} s", name_of(span), span.begins_s);
  const FaultSigns& signs = span.signs;
  OfFault& of_fault = figures_.by_fault[name_of(span)];
  ++figures_.faults_judged;
  ++of_fault.judged;
  if (!signs.counters.empty() || !signs.words.empty() || signs.half_size) {
    const double took_s = span.named_s.value_or(until_s) - span.begins_s;
    if (span.named_s) {
      figures_.slowest_named_s = std::max(figures_.slowest_named_s, took_s);
      of_fault.slowest_named_s = std::max(of_fault.slowest_named_s, took_s);
    }
    if (took_s > kNamedWithin_s + signs.strikes_within_s)
      break_law(span.begins_s, "named", fmt::format("{} was {}", name, span.named_s ? "named late" : "never named"));
  }
  if (span.ends_s + kAlone_s >= until_s) return;
  for (const auto& [what, again_s] : {std::pair{"poses", span.poses_again_s}, {"frames", span.frames_again_s}}) {
    const double took_s = again_s.value_or(until_s) - span.ends_s;
    if (again_s) {
      figures_.slowest_over_s = std::max(figures_.slowest_over_s, took_s);
      of_fault.slowest_over_s = std::max(of_fault.slowest_over_s, *again_s - span.own_end_s);
    }
    if (took_s > kOverWithin_s)
      break_law(span.ends_s, "over", fmt::format("{}: {} are there {:.1f} s after its end", name, what, took_s));
  }
}

void OperationLaws::finish(double until_s) {
  for (const auto& [name, of] : doubts_.figures()) figures_.by_fault["doubt " + name] = {of.began, of.judged, 0, 0};
  if (static_cast<double>(figures_.beyond) >
      kMostBeyond * static_cast<double>(std::max(figures_.judged, kFewestJudged))) {
    break_law(until_s, "circle",
              fmt::format("{} of {} whole overlays are off by more than {} circles", figures_.beyond, figures_.judged,
                          kPromisedCircles));
  }
  for (const Span& span : spans_) {
    // One that lasts for good is named all the same.
    const bool ends = std::isfinite(span.ends_s);
    if (span.alone && span.of != FaultTarget::world && (ends ? span.ends_s : span.begins_s) + kAlone_s < until_s)
      judge(span, until_s);
  }
}

}  // namespace birdseye::hw_sim
