#include "host/operation/reference_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kLost = Duration::from_ms(100);    // without a pose: a few records may be damaged
constexpr Duration kBridged = Duration::from_ms(50);  // so long its pose is taken to go on as it did
constexpr Duration kHalfWindow = Duration::from_ms(25);
constexpr Duration kApart = Duration::from_ms(100);

// A tilting table moves a sensor 300 mm off its axis at 20 mm/s and turns at 4 deg/s; a hand or a cable pulls faster.
constexpr double kMostMm = 4, kMostDeg = 2;  // in kApart
// By so much more a bird may have moved otherwise than with the reference: what a hand does, and what the lever makes
// of noise. A reference that slips in the moment in which the transmitter is bumped may not hide in it.
constexpr double kMostSlackMm = 3, kMostSlackDeg = 1.5;
constexpr double kMostSigmas = 6;  // of a tracker that scatters by more than that

PoseHistory::Settings averaging(Duration most_predicted) {
  PoseHistory::Settings settings;
  settings.max_prediction = most_predicted;
  settings.smoothing = kHalfWindow;
  return settings;
}

/// Where a bird was, averaged, and where it is later.
struct Move {
  Transform<Tracker, Sensor> before, after;
  double sigma_mm = 0;
  Duration apart = kApart;

  /// What takes the tracker as this bird had it before to how it has it after, were the bird at rest.
  [[nodiscard]] Transform<Tracker, Tracker> of_tracker() const { return after * before.inverse(); }
};

std::optional<Move> move_of(const PoseHistory& history, DeviceTime at, Duration apart = kApart) {
  const DeviceTime after = at - kHalfWindow;
  const PoseAnswer now = history.at(after), then = history.at(after - apart);
  if (!now.tracker_from_sensor || !then.tracker_from_sensor) return std::nullopt;
  return Move{*then.tracker_from_sensor, *now.tracker_from_sensor,
              std::hypot(now.position_sigma_mm, then.position_sigma_mm), apart};
}

/// Over kApart; where there is a hole then, from before it.
std::optional<Move> newest_move_of(const PoseHistory& history, DeviceTime at) {
  constexpr Duration kStep = Duration::from_ms(10);
  std::optional<Move> move;
  for (Duration apart = kApart; !move && apart <= kApart + kLost; apart = apart + kStep)
    move = move_of(history, at, apart);
  return move;
}

double turn_deg(const Eigen::Matrix3d& rotation) {
  return rotation_log(rotation).norm() / kRadPerDeg;
}

}  // namespace

void ReferenceSensor::use(const std::string& name, const std::string& scope) {
  if (name == name_ && scope == scope_) return;
  name_ = name;
  scope_ = scope;
  lost_ = false;
  doubt_.clear();
  begin_anew();
}

void ReferenceSensor::begin_anew() {
  in_tracker_.clear();
  scope_in_reference_ = PoseHistory(averaging(PoseHistory::Settings().max_prediction));
}

void ReferenceSensor::lose() {
  lost_ = lost_ || in_tracker_.contains(name_);
  begin_anew();
}

ReferenceSensor::Relative ReferenceSensor::take(const wire::Event& event) {
  if (!in_use()) return {event};
  if (const auto* birds = std::get_if<wire::Birds>(&event)) return of_birds(*birds);
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) return of_frame(*frame);
  if (const auto* doubt = std::get_if<wire::Doubt>(&event); doubt != nullptr && doubt->bird == name_)
    doubt_ = doubt->why;
  return {event};
}

std::string ReferenceSensor::why_absent() const {
  return words("reference_absent", name_) + (doubt_.empty() ? "" : ": " + doubt_);
}

/// At a time at which it gave no pose.
ReferenceSensor::News ReferenceSensor::note_absence(DeviceTime at) {
  const auto found = in_tracker_.find(name_);
  if (lost_ || found == in_tracker_.end() || at - *found->second.newest() <= kLost) return News::none;
  lost_ = true;
  return News::lost;
}

ReferenceSensor::Relative ReferenceSensor::of_birds(const wire::Birds& birds) {
  wire::Birds relative{birds.acquired, {}};
  News news = News::none;
  const auto of_name = [this](const wire::Bird& bird) { return bird.name == name_; };
  const bool seen = std::any_of(birds.birds.begin(), birds.birds.end(), of_name);
  const auto before = in_tracker_.find(name_);
  const std::optional<DeviceTime> newest = before == in_tracker_.end() ? std::nullopt : before->second.newest();
  const bool back = newest && birds.acquired < *newest - kLost;  // another clock, whose times must not meet the old
  if (back) begin_anew();
  if (back || (newest && birds.acquired - *newest > kLost)) {
    if (!lost_) news = News::lost;
    lost_ = true;
  }
  for (const wire::Bird& bird : birds.birds) {
    const auto history = in_tracker_.try_emplace(bird.name, averaging(kBridged)).first;
    history->second.push(birds.acquired, {}, bird.tracker_from_sensor);
  }
  if (seen && lost_) {
    lost_ = false;
    doubt_.clear();
    news = News::returned;
  }
  if (seen && news == News::none && came_off(birds.acquired)) news = News::moved;
  // Of one measurement where it can be: a transmitter that moves cancels to the last bit.
  std::optional<Transform<Tracker, Sensor>> reference;
  if (const auto own = std::find_if(birds.birds.begin(), birds.birds.end(), of_name); own != birds.birds.end()) {
    reference = own->tracker_from_sensor;
  } else if (const auto known = in_tracker_.find(name_); known != in_tracker_.end()) {
    reference = known->second.at(birds.acquired).tracker_from_sensor;
  }
  if (!reference) return {relative, news};
  const Transform<Sensor, Tracker> reference_from_tracker = reference->inverse();
  for (const wire::Bird& bird : birds.birds) {
    if (of_name(bird)) continue;
    const auto in_reference = (reference_from_tracker * bird.tracker_from_sensor).matrix();
    relative.birds.push_back({bird.name, Transform<Tracker, Sensor>::from_matrix(in_reference)});
    if (bird.name == scope_) scope_in_reference_.push(birds.acquired, {}, relative.birds.back().tracker_from_sensor);
  }
  return {relative, news};
}

/// A bumped transmitter moves all birds alike, as this one says; a reference that came off moves alone. Where another
/// bird stayed, or none went along, it moved alone.
bool ReferenceSensor::came_off(DeviceTime at) const {
  const auto own = newest_move_of(in_tracker_.at(name_), at);
  if (!own) return false;
  const double longer = own->apart.seconds() / kApart.seconds();
  const double most_mm = std::max(longer * kMostMm, kMostSigmas * std::sqrt(3.0) * own->sigma_mm);
  const Transform<Tracker, Tracker> by = own->of_tracker();
  if ((own->after.translation() - own->before.translation()).norm() <= most_mm &&
      turn_deg(by.rotation()) <= longer * kMostDeg)
    return false;
  bool along = false;
  for (const auto& [name, history] : in_tracker_) {
    if (name == name_) continue;
    const auto other = move_of(history, at, own->apart);
    if (!other) continue;
    const Transform<Tracker, Sensor> with_it = by * other->before;
    const double would_mm = (with_it.translation() - other->before.translation()).norm();
    const double slack_mm = std::min(1 + 0.35 * would_mm, kMostSlackMm);
    const double slack_deg = std::min(0.5 + 0.5 * turn_deg(by.rotation()), kMostSlackDeg);
    const auto is_near = [&](const Transform<Tracker, Sensor>& place) {
      return (other->after.translation() - place.translation()).norm() < slack_mm &&
             turn_deg(place.rotation().transpose() * other->after.rotation()) < slack_deg;
    };
    const bool went = is_near(with_it), stayed = is_near(other->before);
    if (stayed && !went) return true;
    along = along || (went && !stayed);
  }
  return !along;
}

/// From the scope's relative poses; where no bird is called as the scope is, from the pose that the frame came with and
/// the reference's at that time.
PoseAnswer ReferenceSensor::scope_at(DeviceTime at, const PoseAnswer& in_tracker) const {
  if (scope_in_reference_.newest()) return scope_in_reference_.at(at);
  const auto known = in_tracker_.find(name_);
  PoseAnswer out = known == in_tracker_.end() ? PoseAnswer() : known->second.at(at);
  if (!out.tracker_from_sensor) return out;
  const auto in_reference = out.tracker_from_sensor->inverse() * *in_tracker.tracker_from_sensor;
  const double sigma_mm = out.position_sigma_mm;
  out = in_tracker;
  out.tracker_from_sensor = Transform<Tracker, Sensor>::from_matrix(in_reference.matrix());
  out.position_sigma_mm = std::hypot(in_tracker.position_sigma_mm, sigma_mm);
  return out;
}

ReferenceSensor::Relative ReferenceSensor::of_frame(wire::VideoFrame frame) {
  PoseAnswer& pose = frame.info.pose;
  const News news = note_absence(frame.info.acquired);
  if (!pose.tracker_from_sensor) return {std::move(frame), news};
  PoseAnswer relative = scope_at(frame.info.acquired, pose);
  if (lost_ || !in_tracker_.contains(name_)) {
    relative.kind = PoseKind::refused;
    relative.tracker_from_sensor.reset();
    relative.reason = why_absent();
    relative.age = pose.age;  // the scope's pose is no older for that
  }
  // The scatter of relative poses is both birds'; of too few nothing is told, and the appliance's own counts.
  relative.position_sigma_mm = std::max(relative.position_sigma_mm, pose.position_sigma_mm);
  relative.time_sigma = pose.time_sigma;
  pose = relative;
  return {std::move(frame), news};
}

}  // namespace birdseye::host
