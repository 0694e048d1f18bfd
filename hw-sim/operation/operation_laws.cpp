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
constexpr double kMostAge_ms = 150;
constexpr double kMostCircles = 3, kPromisedCircles = 1.5;
constexpr double kMostBeyond = 0.001;  // of whole overlays, by more than the latter
constexpr std::uint64_t kFewestJudged = 10'000;
constexpr double kNamedWithin_s = 2, kOverWithin_s = 2;
constexpr double kCalm_s = 10;     // after a fault's end what it had the window see may still be weighed
constexpr double kAlone_s = 5;     // from another fault's end to this one's begin, and after it
constexpr double kLinger_s = 0.5;  // after a fault's end poses may still be made of samples that it touched
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

/// Of what befalls the world: from how it was to how it is.
double takes_s(const Fault& fault) {
  return fault.values.contains("over_s") ? fault.value("over_s") : 0;
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
    : truth_(truth), exposed_ns_(std::move(exposed_ns)), zero_ns_(zero_ns), begins_at_board_(truth.at_board(0)) {
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

void OperationLaws::note_motion(bool whole, double now_s) {
  constexpr double kWatched_s = 0.5;
  for (; next_move_ < moves_.size() && moves_[next_move_].begins_s <= now_s; ++next_move_) {
    if (!moves_[next_move_].of_patient) continue;
    ++figures_.moved;
    if (!registered_ || (whole_s_ && moves_[next_move_].begins_s - *whole_s_ < kWatched_s)) continue;
    ++figures_.moved_unwatched;
    unwatched_to_s_ = moves_[next_move_].ends_s;
  }
  if (whole) whole_s_ = now_s;
}

/// What the frame shows is on its way, or was so lately that no later frame can have told of it.
bool OperationLaws::moves_at(double exposed_s) const {
  constexpr double kTakes_s = 0.1;
  return std::ranges::any_of(moves_, [exposed_s](const Move& move) {
    return exposed_s >= move.begins_s && exposed_s < move.ends_s + kTakes_s;
  });
}

/// Of a whole overlay: the turn of the scope, or the zoom of the lens, must have been seen.
void OperationLaws::judge_scope(double exposed_s, double now_s) {
  constexpr double kSeenWithin_s = 3, kTurned_deg = 20, kZoomed = 1.15;
  for (const Span& span : spans_) {
    const Fault& fault = span.fault;
    const bool turned = fault.kind == FaultKind::scope_turned && std::abs(fault.value("deg")) >= kTurned_deg;
    const bool zoomed =
        fault.kind == FaultKind::lens_zoomed && std::max(fault.value("factor"), 1 / fault.value("factor")) >= kZoomed;
    if (!turned && !zoomed) continue;
    const double since_s = exposed_s - fault.at_s - takes_s(fault);
    if (since_s > kSeenWithin_s && exposed_s < span.ends_s)
      break_law(now_s, "turned", fmt::format("an overlay is whole {:.1f} s after {}", since_s, fault_name(fault.kind)));
  }
}

/// What the video shows is true: where no fault has touched its times or the poses, nobody may say that they differ.
void OperationLaws::judge_accusation(bool accused, double now_s) {
  const bool begins = accused && !accused_;
  accused_ = accused;
  const auto touches = [now_s](const Span& span) {
    return !span.signs.aside && span.begins_s <= now_s && now_s < span.ends_s + kCalm_s;
  };
  if (begins && std::ranges::none_of(spans_, touches))
    break_law(now_s, "accused", "the window says that video and poses do not agree, and nothing has befallen them");
}

void OperationLaws::take(const host::ShownPicture& shown, const host::LivePicture& picture, HostTime now) {
  const double now_s = at_s(now.ns);
  ++figures_.shown;
  note_motion(is_whole(shown), now_s);
  if (!shown.overlaid || shown.strength <= 0 || !picture.frame()) return;
  ++figures_.overlaid;
  if (checks_when_opened_)
    break_law(now_s, "kept", "the window was opened again, and draws before a landmark was checked");
  const auto exposed_ns = exposed_ns_(picture.frame()->info.sequence);
  if (!exposed_ns) return break_law(now_s, "age", "an overlay is on a frame that the camera never gave");
  const double exposed_s = at_s(*exposed_ns);
  const std::size_t scope = truth_.scope_in_use(exposed_s);
  if (!begins_at_board_ && (!picture.setup() || picture.setup()->camera() != truth_.record_of(scope).lens->camera))
    break_law(now_s, "setup", "an overlay is drawn with the calibration of a scope that is not in use");
  if (in_doubt_) break_law(now_s, "setup", "an overlay is drawn by a registration that is in doubt or held back");
  double lies_s = 0;
  bool lies = false;
  for (const Span& span : spans_) {
    if (exposed_s < span.begins_s - kLinger_s || exposed_s > span.ends_s + kLinger_s) continue;
    if (span.of == FaultTarget::camera) lies_s += span.signs.extra_s;
    lies = lies || span.signs.lies || span.signs.extra_mm > 0 || span.signs.extra_s > 0;
  }
  const double age_ms = 1e3 * (now_s - exposed_s - lies_s);
  figures_.worst_age_ms = std::max(figures_.worst_age_ms, age_ms);
  if (age_ms > kMostAge_ms)
    break_law(now_s, "age", fmt::format("an overlay's frame was exposed {:.0f} ms ago", age_ms));
  const auto drawn_from = picture.camera_from_patient();
  const auto& budget = picture.decision().expected;
  if (!is_whole(shown) || !drawn_from || !budget) return;
  ++figures_.green;
  if (pictures_) judge_scope(exposed_s, now_s);
  if (lies || unwatched_to_s_ || moves_at(exposed_s)) return;
  const Eigen::Vector3d target_mm = truth_.target_mm() + truth_.organ(exposed_s).shift_mm;
  const Eigen::Vector3d true_mm = truth_.camera_from_patient(exposed_s) * target_mm;
  const auto true_px = project(truth_.lens(exposed_s), true_mm);
  const Eigen::Vector3d shown_mm = picture.figures().target_in_patient_mm.value_or(truth_.target_mm());
  const auto drawn_px = project(picture.setup()->camera(), Eigen::Vector3d(*drawn_from * shown_mm));
  if (!true_px || !drawn_px) return;
  ++figures_.judged;
  const double off_mm = (*true_px - *drawn_px).norm() / truth_.lens(exposed_s).fx_px * true_mm.z();
  const double circles = off_mm / budget->radius95_mm();
  figures_.worst_circles = std::max(figures_.worst_circles, circles);
  if (circles > kPromisedCircles) ++figures_.beyond;
  if (circles > kMostCircles) {
    break_law(now_s, "circle",
              fmt::format("a whole overlay is {:.1f} mm off, its circle {:.1f} mm", off_mm, budget->radius95_mm()));
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
    figures_.slowest_named_s = std::max(figures_.slowest_named_s, took_s);
    of_fault.slowest_named_s = std::max(of_fault.slowest_named_s, took_s);
    if (took_s > kNamedWithin_s + signs.strikes_within_s)
      break_law(span.begins_s, "named", fmt::format("{} was {}", name, span.named_s ? "named late" : "never named"));
  }
  if (span.ends_s + kAlone_s >= until_s) return;
  for (const auto& [what, again_s] : {std::pair{"poses", span.poses_again_s}, {"frames", span.frames_again_s}}) {
    const double took_s = again_s.value_or(until_s) - span.ends_s;
    figures_.slowest_over_s = std::max(figures_.slowest_over_s, took_s);
    of_fault.slowest_over_s = std::max(of_fault.slowest_over_s, again_s.value_or(until_s) - span.own_end_s);
    if (took_s > kOverWithin_s)
      break_law(span.ends_s, "over", fmt::format("{}: {} are there {:.1f} s after its end", name, what, took_s));
  }
}

void OperationLaws::finish(double until_s) {
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
