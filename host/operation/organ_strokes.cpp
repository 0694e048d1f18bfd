#include "host/operation/organ_strokes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kAround = Duration::from_ms(100);  // before and after a sample, for what it is worth
constexpr Duration kLine = Duration::from_ms(50);     // the same, over which a hand goes nearly straight on
constexpr Duration kMean = Duration::from_ms(25);     // the same, over which a place is the mean
constexpr double kFastest_mm_s = 200;                 // of a stroke
constexpr double kApart_mm = 2;
constexpr std::size_t kMostSamples = 1000;  // of a tracker ten times as fast as any

constexpr double kUnknownNoise_mm = 0.5;  // one axis of a sample, where too few tell of it
constexpr double kPressed_mm = 0.5;       // by how much a light touch dents the organ, or leaves it
constexpr double kUnknown_mm = 1;         // what a calibration is off by whose error is not known

/// How samples go on straight: how fast, and how far they scatter about that, one axis.
struct Going {
  Eigen::Vector3d velocity_mm_s;
  double scatter_mm = 0;
};

/// Empty: the samples are too few.
template <typename Samples>
std::optional<Going> going(const Samples& samples) {
  constexpr std::size_t kFewest = 4;
  if (samples.size() < kFewest) return std::nullopt;
  const auto count = static_cast<double>(samples.size());
  const auto since_s = [&](const auto& sample) { return (sample.at - samples.front().at).seconds(); };
  double mean_s = 0, squares_s2 = 0, squares_mm2 = 0;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero(), slope = Eigen::Vector3d::Zero();
  for (const auto& sample : samples) {
    mean_s += since_s(sample) / count;
    mean_mm += sample.tip_mm / count;
  }
  for (const auto& sample : samples) {
    squares_s2 += std::pow(since_s(sample) - mean_s, 2);
    slope += (since_s(sample) - mean_s) * sample.tip_mm;
  }
  slope /= squares_s2;
  for (const auto& sample : samples)
    squares_mm2 += (sample.tip_mm - mean_mm - (since_s(sample) - mean_s) * slope).squaredNorm();
  return Going{slope, std::sqrt(squares_mm2 / (3 * (count - 2)))};
}

}  // namespace

void OrganStrokes::begin(std::size_t views) {
  end();
  stroking_ = true;
  strokes_.push_back({views, {}, {}});
  samples_.clear();
  tell();
}

void OrganStrokes::end() {
  if (!stroking_) return;
  stroking_ = false;
  line_.clear();
  if (!strokes_.back().places.empty()) return;
  strokes_.pop_back();
  line_ = words("note_nothing_touched");
}

void OrganStrokes::take(DeviceTime acquired, const Eigen::Vector3d& tip_in_patient_mm) {
  if (!stroking_ || !tip_in_patient_mm.allFinite()) return;
  if (!samples_.empty() && acquired <= samples_.back().at) return;
  // What lies before a gap is not known to have stayed on the organ.
  if (!samples_.empty() && acquired - samples_.back().at > kAround) samples_.clear();
  if (samples_.empty()) judged_ = acquired;
  samples_.push_back({acquired, tip_in_patient_mm});
  for (std::size_t i = 0; i < samples_.size() && acquired - samples_[i].at >= kAround; ++i) {
    if (samples_[i].at <= judged_) continue;
    judged_ = samples_[i].at;
    judge(i);
  }
  while (samples_.size() > kMostSamples || (samples_.size() > 1 && acquired - samples_[1].at >= kAround + kAround))
    samples_.pop_front();
  tell();
}

/// Whether a sample is of the tip on the organ; then it becomes a place, where it is far enough from the last.
void OrganStrokes::judge(std::size_t which) {
  const Sample& sample = samples_[which];
  if (sample.at - samples_.front().at < kAround || places() >= kMostTouchedPlaces) return;
  Stroke& stroke = strokes_.back();
  std::vector<Sample> line;
  SeenPoint place{Eigen::Vector3d::Zero(), 0, std::nullopt};
  double count = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Sample& other = samples_[i];
    const Duration away{std::abs((other.at - sample.at).ns)};
    // The last one from before the tenth of a second counts too, so that no motion is missed between two samples.
    const bool last_before =
        i + 1 < samples_.size() && other.at < sample.at && sample.at - samples_[i + 1].at < kAround;
    if (away > kAround && !last_before) continue;
    if ((other.tip_mm - sample.tip_mm).norm() > kFastest_mm_s * kAround.seconds()) return;
    if (away <= kLine) line.push_back(other);
    if (away > kMean) continue;
    place.place_mm += other.tip_mm;
    count += 1;
  }
  place.place_mm /= count;
  // A short lift is not far away within a tenth of a second, but it is fast.
  const auto along = going(line);
  if (along && along->velocity_mm_s.norm() > kFastest_mm_s) return;
  const double noise_mm = along ? along->scatter_mm : kUnknownNoise_mm;
  place.sigma_mm = std::hypot(noise_mm / std::sqrt(count), kPressed_mm);
  // Nor is a sample to count in two places, whose errors would be alike then.
  const bool near = !stroke.places.empty() && (sample.at - stroke.newest <= kMean + kMean ||
                                               (place.place_mm - stroke.places.back().place_mm).norm() < kApart_mm);
  if (near) return;
  stroke.places.push_back(place);
  stroke.newest = sample.at;
}

bool OrganStrokes::undo(std::size_t views) {
  if (strokes_.empty() || strokes_.back().views_before < views) return false;
  strokes_.pop_back();
  stroking_ = false;
  line_.clear();
  return true;
}

void OrganStrokes::forget() {
  strokes_.clear();
  stroking_ = false;
  line_.clear();
}

std::size_t OrganStrokes::places() const {
  std::size_t out = 0;
  for (const Stroke& stroke : strokes_) out += stroke.places.size();
  return out;
}

std::vector<SeenPoint> OrganStrokes::touches(double shift_mm) const {
  std::vector<SeenPoint> out;
  for (const Stroke& stroke : strokes_) out.insert(out.end(), stroke.places.begin(), stroke.places.end());
  for (SeenPoint& place : out) place.shift_mm = shift_mm;
  return out;
}

void OrganStrokes::tell() {
  const bool full = places() >= kMostTouchedPlaces;
  line_ = full ? words("note_most_places", kMostTouchedPlaces) : words("note_stroking");
}

double tip_shift_mm(std::optional<double> tip_rms_mm, std::optional<double> hand_eye_mm) {
  // The tip's is of three axes, hand-eye's of the two across the line of sight.
  return std::hypot(tip_rms_mm.value_or(kUnknown_mm) / std::sqrt(3.0),
                    hand_eye_mm.value_or(kUnknown_mm) / std::sqrt(2.0));
}

}  // namespace birdseye::host
