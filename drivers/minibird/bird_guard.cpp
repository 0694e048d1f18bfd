#include "drivers/minibird/bird_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/base/units.hpp"

namespace birdseye::drivers::minibird {

namespace {

constexpr std::size_t kTrack = 4;  // readings that a line is laid through
// A line through so many readings misses the next on a parabola by five times a t^2 / 2.
constexpr double kParabola = 2.5;
constexpr Duration kTrackHolds = Duration::from_ms(100);  // for so long a line through readings foretells the next
// Where no line through the last readings foretells the next, a reading may be as far away as a sensor gets in this
// time, or in one and a half periods of the stream. One that is farther is believed once the next reading agrees, also
// after a long gap.
constexpr Duration kUnforeseen = Duration::from_ms(10);
constexpr double kNoiseMemory = 1.0 / 64;  // of the mean square, per reading
constexpr double kNoiseSigmas = 3.5;
constexpr double kMostNoiseMm = 5;            // beyond that it is not noise
constexpr double kRestless = 0.2;             // of ways lead back where there is noise; without, hardly any
constexpr double kDamageMemory = 1.0 / 32;    // of how often readings make no sense, per reading
constexpr double kMostDamaged = 0.08;         // three of the last readings: a jerk and a bump make two
constexpr std::size_t kRecent = 16;           // records, among which one that repeats is looked for
constexpr double kRepeatsMemory = 1.0 / 128;  // of how often one does, per reading; of all of them at first
constexpr double kSeldom = 0.02;              // two just now are less; three then are chance once in 10^6
constexpr int kFrozenWhereSeldom = 3;
// A frozen bird repeats one record in half of its records or more, even where the line damages the other half. A bird
// is alive once its first kRecent records all differ, or once no record makes up more than a quarter of the last
// kManyRecords. Until then, and from kFirst records on, a bird is believed as long as none makes up more than an
// eighth.
constexpr std::size_t kFirst = 4, kManyRecords = 64;
constexpr double kMuchNearer = 3;  // the mirrored position, than the one reported

Duration gap_between(DeviceTime earlier, DeviceTime later) {
  return std::max(later - earlier, Duration{0});
}

double angle_deg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::acos(std::clamp(((a.transpose() * b).trace() - 1) / 2, -1.0, 1.0)) / kRadPerDeg;
}

}  // namespace

std::optional<BirdGuard::Objection> BirdGuard::doubt_of_words(const std::vector<std::int16_t>& words) const {
  const auto first_of_rotation = words.begin() + (has_position(layout_.format) ? 3 : 0);
  const bool zeroed = has_orientation(layout_.format) && words.end() - first_of_rotation != 3 &&
                      std::all_of(first_of_rotation, words.end(), [](std::int16_t word) { return word == 0; });
  if (zeroed)
    return Objection{DoubtKind::saturated, "sensor saturated: too close to the transmitter or in a strong field"};
  // The outputs stop at the end of the scale: the words 8000 and 7FFC.
  const bool at_end =
      std::any_of(words.begin(), first_of_rotation, [](std::int16_t word) { return word <= -32768 || word >= 32764; });
  if (has_position(layout_.format) && at_end) {
    return Objection{DoubtKind::beyond_scale,
                     fmt::format("position beyond the scale of {:.0f} mm", layout_.mm_per_count * 32768)};
  }
  return std::nullopt;
}

/// Whether all records lie within two steps of the commonest one, as those of a live sensor at rest do that has little
/// noise. Damaged records lie farther away. alike: each record, and how often it came.
bool BirdGuard::is_quiet(const std::map<std::vector<std::int16_t>, std::size_t>& alike) {
  constexpr int kNear = 8;  // two steps of what a word counts in
  const auto& commonest = std::ranges::max_element(alike, {}, [](const auto& record) { return record.second; })->first;
  const auto near = [&commonest](const auto& record) {
    return std::ranges::equal(record.first, commonest, [](int a, int b) { return std::abs(a - b) <= kNear; });
  };
  return alike.size() >= kFirst && std::ranges::all_of(alike, near);
}

/// Only what a sensor has sent before tells frozen from at rest, and at first there is nothing before.
std::optional<BirdGuard::Objection> BirdGuard::doubt_of_life() {
  if (alive_ || limits_.frozen_after <= 0) return std::nullopt;
  const std::size_t count = first_words_.size();
  std::map<std::vector<std::int16_t>, std::size_t> alike;
  std::size_t most = 0;
  for (const auto& record : first_words_) most = std::max(most, ++alike[record]);
  alive_ = (count >= kRecent && most == 1) || (count == kManyRecords && (4 * most <= count || is_quiet(alike)));
  if (alive_) first_words_.clear();
  if (alive_ || (count >= kFirst && most <= std::max(std::size_t{1}, count / 8))) return std::nullopt;
  if (count < kRecent)
    return Objection{DoubtKind::unconfirmed, "not yet confirmed: its records since the start are hardly different"};
  return Objection{DoubtKind::frozen, "frozen, or without noise and at rest, since the start: move the sensor"};
}

std::optional<BirdGuard::Objection> BirdGuard::doubt_of_repeats(const std::vector<std::int16_t>& words,
                                                                DeviceTime time) {
  // A damaged record between those of a frozen bird is no sign of life.
  const auto same = static_cast<int>(std::count(recent_words_.begin(), recent_words_.end(), words));
  recent_words_.push_back(words);
  if (recent_words_.size() > kRecent) recent_words_.pop_front();
  const bool where_seldom = noise_.repeats < kSeldom && same >= kFrozenWhereSeldom;
  if (limits_.frozen_after > 0 && (where_seldom || (noise_is_plain() && same >= limits_.frozen_after_plain_noise))) {
    if (words == last_words_) ++repeats_;
    return Objection{DoubtKind::frozen, fmt::format("frozen: the same record {} times", same + 1)};
  }
  noise_.newest = std::max(noise_.newest / (1 + noise_.newest), kRepeatsMemory);
  noise_.repeats += noise_.newest * ((same > 0 ? 1 : 0) - noise_.repeats);
  if (words != last_words_) {
    last_words_ = words;
    repeats_ = 0;
    repeated_since_ = time;
    return std::nullopt;
  }
  ++repeats_;
  if (limits_.frozen_after <= 0) return std::nullopt;
  const double moved_mm = speed_mm_s_ * std::min(gap_between(repeated_since_, time), kTrackHolds).seconds();
  const bool noise_is_gone = repeats_ >= limits_.frozen_after && noise_.restless > kRestless;
  if (!noise_is_gone && moved_mm < limits_.frozen_moved_mm) return std::nullopt;
  return Objection{DoubtKind::frozen, fmt::format("frozen: the same record {} times", repeats_ + 1)};
}

/// Whether a record that repeats says of itself that the sensor does not.
bool BirdGuard::noise_is_plain() const {
  return limits_.frozen_after > 0 && noise_.restless > kRestless && noise_.back_counts >= limits_.frozen_noise_counts;
}

bool BirdGuard::within_reach(const Sample& from, const Sample& to) const {
  const double seconds = (gap_between(from.time, to.time) + from.sigma + to.sigma).seconds();
  return (to.position_mm - from.position_mm).norm() <= limits_.slack_mm + limits_.most_speed_mm_s * seconds &&
         angle_deg(from.rotation, to.rotation) <= limits_.slack_deg + limits_.most_turn_deg_s * seconds;
}

std::optional<Eigen::Vector3d> BirdGuard::predicted_mm(DeviceTime time) const {
  if (track_.size() < kTrack || !track_.front().time_certain || time - track_.front().time > kTrackHolds)
    return std::nullopt;
  double mean_s = 0, square_s2 = 0;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (const Sample& s : track_) {
    mean_s += (s.time - time).seconds() / kTrack;
    mean_mm += s.position_mm / kTrack;
  }
  for (const Sample& s : track_) {
    const double t = (s.time - time).seconds() - mean_s;
    square_s2 += t * t;
    moment += t * (s.position_mm - mean_mm);
  }
  if (square_s2 < 1e-9) return std::nullopt;
  return Eigen::Vector3d(mean_mm - mean_s * (moment / square_s2));
}

/// in_reach: further off the track than a sensor gets in one period. After readings that were lost or withheld the
/// sensor may have come there all the same; or the reading is damaged.
BirdGuard::Placed BirdGuard::placed(const Sample& sample) {
  if (!within_reach(track_.back(), sample)) return Placed::off;
  const Duration gap = gap_between(track_.back().time, sample.time);
  bool after_doubt = candidate_ || !made_sense_;
  const auto predicted = predicted_mm(sample.time);
  if (!predicted || !sample.time_certain) {
    const double went_mm = (sample.position_mm - last_mm_).norm();
    const Duration one{std::max(kUnforeseen.ns, usual_.ns * 3 / 2)};
    const bool sudden = went_mm > limits_.slack_mm + limits_.most_speed_mm_s * one.seconds();
    return after_doubt || sudden ? Placed::in_reach : Placed::on_track;
  }
  Duration usual = gap;
  for (std::size_t i = 1; i < track_.size(); ++i)
    usual = std::min(usual, gap_between(track_[i - 1].time, track_[i].time));
  after_doubt = after_doubt || gap.ns > usual.ns + usual.ns / 2;
  const double seconds = (gap + sample.sigma).seconds(), usual_s = (usual + sample.sigma).seconds();
  const double noise_mm = std::min(std::sqrt(noise_mm2_), kMostNoiseMm);
  const auto most_mm = [&](double s) {
    return limits_.slack_mm + kParabola * limits_.most_acceleration_mm_s2 * s * s + kNoiseSigmas * noise_mm;
  };
  const double all_mm = most_mm(seconds);
  const double off_mm = (sample.position_mm - *predicted).norm();
  const double counted_mm = std::min(off_mm, all_mm);  // a damaged reading is not noise, or not all of it
  noise_mm2_ += kNoiseMemory * (counted_mm * counted_mm - noise_mm2_);
  if (off_mm > all_mm) return Placed::off;
  return after_doubt && off_mm > most_mm(usual_s) ? Placed::in_reach : Placed::on_track;
}

bool BirdGuard::is_mirrored(const Sample& sample) const {
  if (track_.empty() || !has_position(layout_.format)) return false;
  const Sample& last = track_.back();
  const Duration since = gap_between(last.time, sample.time);
  if (since > limits_.flip_memory) return false;
  const double as_told_mm = (sample.position_mm - last.position_mm).norm();
  const double negated_mm = (-sample.position_mm - last.position_mm).norm();
  const double turn_deg = angle_deg(last.rotation, sample.rotation);
  return negated_mm * kMuchNearer < as_told_mm &&
         turn_deg <= limits_.slack_deg + limits_.most_turn_deg_s * (since + sample.sigma).seconds();
}

BirdGuard::Objection BirdGuard::doubt_of_side(const Eigen::Vector3d& reported_mm, bool mirrored) const {
  if (!has_position(layout_.format)) return {};
  if (mirrored) return {DoubtKind::hemisphere_flip, "hemisphere flip: the position is the negative of where it was"};
  const double side_mm = layout_.into_hemisphere.dot(reported_mm);
  if (std::abs(side_mm) < limits_.hemisphere_border_mm) {
    return {DoubtKind::hemisphere_border, fmt::format("near the hemisphere's border: {:.0f} mm", std::abs(side_mm))};
  }
  if (side_mm < 0) return {DoubtKind::outside_hemisphere, "outside the hemisphere that is set: has the unit lost it?"};
  return {};
}

void BirdGuard::follow(const Sample& sample) {
  candidate_.reset();
  agreeing_ = 0;
  was_frozen_ = false;
  last_mm_ = sample.position_mm;
  if (!track_.empty() && track_.front().time_certain != sample.time_certain) {
    if (!sample.time_certain) return;
    track_.clear();
  }
  track_.push_back(sample);
  if (track_.size() > kTrack) track_.pop_front();
  if (!sample.time_certain) return;
  if (repeats_ > 0 || track_.size() < 2) return;
  const Eigen::Vector3d way_mm = track_.back().position_mm - track_[track_.size() - 2].position_mm;
  const bool back = way_mm.dot(last_way_mm_) < 0;
  noise_.restless += kNoiseMemory * ((back ? 1 : 0) - noise_.restless);
  if (back) noise_.back_counts += kNoiseMemory * (way_mm.norm() / layout_.mm_per_count - noise_.back_counts);
  last_way_mm_ = way_mm;
  const double seconds = (track_.back().time - track_.front().time).seconds();
  speed_mm_s_ =
      seconds > 1e-4 ? (track_.back().position_mm - track_.front().position_mm).norm() / seconds : speed_mm_s_;
}

BirdGuard::Objection BirdGuard::place(Sample sample) {
  const Eigen::Vector3d reported_mm = sample.position_mm;
  const bool mirrored = is_mirrored(sample);
  if (mirrored) sample.position_mm = -reported_mm;
  // Wrong by itself, and no place to follow: what is told as it should be would look like a flip from there.
  if (Objection side = doubt_of_side(reported_mm, mirrored); side.kind == DoubtKind::outside_hemisphere) return side;
  const bool lost_sight = track_.empty() || was_frozen_ || gap_between(track_.back().time, sample.time) > limits_.gap;
  const Placed place = lost_sight ? Placed::off : placed(sample);
  if (place == Placed::on_track) {
    follow(sample);
    return doubt_of_side(reported_mm, mirrored);
  }
  // Off the track. Either this is wrong, or the sensor is elsewhere: then the next readings agree with this one.
  // The same record once more is no other reading, where noise would have changed it.
  const bool another = repeats_ == 0 || !(noise_is_plain() || noise_.repeats < kSeldom);
  agreeing_ = candidate_ && another && within_reach(*candidate_, sample) ? agreeing_ + 1 : 0;
  // Of a bird that was frozen more is asked: damaged records differ too.
  const bool few = !was_frozen_ && (lost_sight || place == Placed::in_reach);
  if (agreeing_ >= (few ? limits_.start_confirms : limits_.step_confirms)) {
    track_.clear();
    follow(sample);
    return doubt_of_side(reported_mm, mirrored);
  }
  candidate_ = sample;
  if (Objection side = doubt_of_side(reported_mm, mirrored); side.kind != DoubtKind::none) return side;
  if (lost_sight) return {DoubtKind::unconfirmed, "not yet confirmed, after a start or a gap"};
  const Sample& last = track_.back();
  return {DoubtKind::step,
          fmt::format("a step of {:.0f} mm and {:.0f} deg in {:.0f} ms", (sample.position_mm - last.position_mm).norm(),
                      angle_deg(last.rotation, sample.rotation), gap_between(last.time, sample.time).seconds() * 1e3)};
}

BirdReading BirdGuard::judge(const Record& record, DeviceTime acquired, Duration sigma, bool time_certain) {
  BirdReading reading = judge_itself(record, acquired, sigma, time_certain);
  const bool makes_sense = reading.kind != DoubtKind::senseless && reading.kind != DoubtKind::step;
  // A sensor that was moved at once is off its track for some readings in a row, and counts once.
  damaged_ += kDamageMemory * ((!makes_sense && made_sense_ ? 1 : 0) - damaged_);
  made_sense_ = makes_sense;
  if (reading.kind != DoubtKind::none || damaged_ < kMostDamaged) return reading;
  reading.kind = DoubtKind::line_noise;
  reading.doubt = fmt::format("line noise: of the last readings {:.0f} % make no sense", 100 * damaged_);
  reading.pose.reset();
  return reading;
}

BirdReading BirdGuard::judge_itself(const Record& record, DeviceTime acquired, Duration sigma, bool time_certain) {
  BirdReading reading;
  reading.button = record.button;
  const auto withhold = [&reading](const Objection& objection) {
    reading.kind = objection.kind;
    reading.doubt = objection.words;
    return reading;
  };
  if (const auto doubt = doubt_of_words(record.words)) return withhold(*doubt);
  auto pose = decode_pose(layout_.format, record.words, layout_.mm_per_count);
  if (!pose) return withhold({DoubtKind::senseless, pose.error().what});
  if (!alive_) first_words_.push_back(record.words);
  if (first_words_.size() > kManyRecords) first_words_.pop_front();
  if (const auto doubt = doubt_of_repeats(record.words, acquired)) {
    was_frozen_ = true;
    candidate_.reset();
    return withhold(*doubt);
  }
  if (judged_at_) {
    const Duration since{std::max<std::int64_t>(gap_between(*judged_at_, acquired).ns, 1'000'000)};
    usual_ = usual_.ns == 0 ? since : std::min(since, Duration{usual_.ns + usual_.ns / 8});
  }
  judged_at_ = acquired;
  Sample sample;
  sample.time = acquired;
  sample.sigma = sigma;
  sample.time_certain = time_certain;
  if (pose->position_mm) sample.position_mm = *pose->position_mm;
  if (pose->rotation) sample.rotation = *pose->rotation;
  if (const Objection objection = place(sample); objection.kind != DoubtKind::none) return withhold(objection);
  if (const auto doubt = doubt_of_life()) return withhold(*doubt);
  reading.kind = DoubtKind::none;
  reading.doubt.clear();
  reading.pose = *std::move(pose);
  return reading;
}

}  // namespace birdseye::drivers::minibird
