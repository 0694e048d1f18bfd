#include "calibration/hand_eye/pose_streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kGreatestOffsetS = 2;
constexpr double kCoarseStepS = 0.01;
constexpr double kFineStepS = 0.001;
/// Between poses further apart nothing is interpolated.
constexpr double kGreatestGapS = 0.2;
/// Angular speed is taken over this long, so that the noise of single poses does not drown it.
constexpr double kSpeedSpanS = 0.2;
constexpr double kLeastCorrelation = 0.5;
constexpr std::size_t kFewestSpeeds = 50;
/// Stations are so far apart, in angle or place, and not more than that many.
constexpr double kStationTurn = 3 * kRadPerDeg;
constexpr double kStationShiftMm = 10;
constexpr std::size_t kMostStreamStations = 400;

double time_of(const StampedSensor& s) {
  return s.time_s;
}
double time_of(const StampedView& s) {
  return s.time_s;
}
const Transform<Tracker, Sensor>& pose_of(const StampedSensor& s) {
  return s.tracker_from_sensor;
}
const Transform<Camera, Marker>& pose_of(const StampedView& s) {
  return s.camera_from_marker;
}

template <typename To, typename From>
Transform<To, From> between(const Transform<To, From>& a, const Transform<To, From>& b, double part) {
  return {a.quaternion().slerp(part, b.quaternion()),
          Eigen::Vector3d((1 - part) * a.translation() + part * b.translation())};
}

/// Interpolated; empty outside the stream and in its gaps.
template <typename Stamped>
auto at(std::span<const Stamped> stream, double time_s) {
  using Pose = std::decay_t<decltype(pose_of(stream[0]))>;
  const auto after =
      std::lower_bound(stream.begin(), stream.end(), time_s, [](const Stamped& s, double t) { return time_of(s) < t; });
  if (after == stream.end() || (after == stream.begin() && time_of(*after) > time_s)) return std::optional<Pose>();
  if (after == stream.begin()) return std::optional<Pose>(pose_of(*after));
  const auto before = std::prev(after);
  const double gap = time_of(*after) - time_of(*before);
  if (!(gap <= kGreatestGapS)) return std::optional<Pose>();
  return std::optional<Pose>(
      between(pose_of(*before), pose_of(*after), gap > 0 ? (time_s - time_of(*before)) / gap : 0));
}

template <typename Stamped>
std::optional<double> speed_at(std::span<const Stamped> stream, double time_s) {
  const auto a = at(stream, time_s - kSpeedSpanS / 2);
  const auto b = at(stream, time_s + kSpeedSpanS / 2);
  if (!a || !b) return std::nullopt;
  return rotation_angle_between(a->rotation(), b->rotation()) / kSpeedSpanS;
}

struct Speed {
  double time_s, rad_s;
};

/// In place of a correlation where too few moments pair.
constexpr double kNothingPairs = -1;

/// Pearson's, of the views' speeds and the sensor's at the same moments; kNothingPairs if too few pair.
double correlation_at(std::span<const StampedSensor> sensor, const std::vector<Speed>& views, double offset_s) {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (const Speed& view : views) {
    const auto other = speed_at(sensor, view.time_s + offset_s);
    if (!other) continue;
    n += 1;
    a += view.rad_s;
    b += *other;
    aa += view.rad_s * view.rad_s;
    bb += *other * *other;
    ab += view.rad_s * *other;
  }
  if (n < static_cast<double>(std::max(kFewestSpeeds, views.size() / 3))) return kNothingPairs;
  const double spread = (aa - a * a / n) * (bb - b * b / n);
  return spread > 0 ? (ab - a * b / n) / std::sqrt(spread) : 0;
}

double best_offset(std::span<const StampedSensor> sensor, const std::vector<Speed>& views, double middle_s,
                   double reach_s, double step_s) {
  double best = middle_s, greatest = -2;
  const int steps = static_cast<int>(std::lround(reach_s / step_s));
  for (int i = -steps; i <= steps; ++i) {
    const double correlation = correlation_at(sensor, views, middle_s + i * step_s);
    if (correlation <= greatest) continue;
    greatest = correlation;
    best = middle_s + i * step_s;
  }
  return best;
}

Motion motion_at(std::span<const StampedSensor> sensor, double time_s) {
  constexpr double kHalfSpanS = 0.03;
  const auto a = at(sensor, time_s - kHalfSpanS);
  const auto b = at(sensor, time_s + kHalfSpanS);
  if (!a || !b) return {};
  return {(b->translation() - a->translation()) / (2 * kHalfSpanS),
          rotation_log(b->rotation() * a->rotation().transpose()) / (2 * kHalfSpanS)};
}

std::vector<HandEyeStation> stations_of(std::span<const StampedSensor> sensor, std::span<const StampedView> views,
                                        double offset_s) {
  std::vector<HandEyeStation> out;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double time_s = views[i].time_s + offset_s;
    const auto pose = at(sensor, time_s);
    if (!pose) continue;
    if (!out.empty()) {
      const auto& last = *out.back().camera_from_marker;
      const auto& now = views[i].camera_from_marker;
      if (rotation_angle_between(last.rotation(), now.rotation()) < kStationTurn &&
          (last.translation() - now.translation()).norm() < kStationShiftMm)
        continue;
    }
    HandEyeStation s;
    s.name = fmt::format("pose {}", i + 1);
    s.tracker_from_sensor = *pose;
    s.camera_from_marker = views[i].camera_from_marker;
    s.sensor_motion = motion_at(sensor, time_s);
    s.time_s = time_s;
    out.push_back(std::move(s));
  }
  const std::size_t count = std::min(out.size(), kMostStreamStations);
  for (std::size_t i = 0; i < count; ++i) std::swap(out[i], out[i * out.size() / count]);
  out.resize(count);
  return out;
}

/// Streams of which no clock's offset that is looked for makes two poses of one moment.
Result<void> check_overlap(std::span<const StampedSensor> sensor, std::span<const StampedView> views) {
  if (sensor.empty() || views.empty()) return Error{Errc::degenerate, "a stream has no poses"};
  const double from_s = std::max(sensor.front().time_s, views.front().time_s);
  const double to_s = std::min(sensor.back().time_s, views.back().time_s);
  if (to_s - from_s > -kGreatestOffsetS) return {};
  return Error{
      Errc::degenerate,
      fmt::format("the two streams do not overlap in time: the sensor's poses are from {:.3f} to {:.3f} s, the "
                  "camera's from {:.3f} to {:.3f} s: record both at once, and give times of one clock in one "
                  "unit",
                  sensor.front().time_s, sensor.back().time_s, views.front().time_s, views.back().time_s)};
}

}  // namespace

Result<StreamPairing> pair_pose_streams(std::span<const StampedSensor> sensor, std::span<const StampedView> views) {
  if (const auto common = check_overlap(sensor, views); !common) return common.error();
  std::vector<Speed> speeds;
  for (const StampedView& view : views) {
    if (const auto speed = speed_at(views, view.time_s)) speeds.push_back({view.time_s, *speed});
  }
  if (speeds.size() < kFewestSpeeds)
    return Error{Errc::degenerate, fmt::format("{} moments of the camera's stream have poses around them, of at least "
                                               "{}: give a longer one, or one with fewer gaps",
                                               speeds.size(), kFewestSpeeds)};
  StreamPairing out;
  const double coarse_s = best_offset(sensor, speeds, 0, kGreatestOffsetS, kCoarseStepS);
  const double fine_s = best_offset(sensor, speeds, coarse_s, kCoarseStepS, kFineStepS);
  // The top of the parabola through three points around the best, far enough apart to stand above the noise.
  constexpr double kReachS = 0.02;
  const double low = correlation_at(sensor, speeds, fine_s - kReachS);
  const double top = correlation_at(sensor, speeds, fine_s);
  const double high = correlation_at(sensor, speeds, fine_s + kReachS);
  const double bend = low - 2 * top + high;
  out.offset_s = bend < 0 ? fine_s + std::clamp(0.5 * (low - high) / bend, -1.0, 1.0) * kReachS : fine_s;
  out.correlation = top;
  if (top <= kNothingPairs) {
    return Error{Errc::degenerate,
                 fmt::format("the two streams have too few moments in common: the sensor's poses are from {:.3f} to "
                             "{:.3f} s, the camera's from {:.3f} to {:.3f} s: record both for the same time, without "
                             "holes of more than {:.1f} s",
                             sensor.front().time_s, sensor.back().time_s, views.front().time_s, views.back().time_s,
                             kGreatestGapS)};
  }
  if (!(top >= kLeastCorrelation))
    return Error{
        Errc::degenerate,
        fmt::format("the two streams' angular speeds do not correlate ({:.2f}, of at least {:.1f}): are they of "
                    "the same motion, on clocks that agree to {:.0f} s?",
                    top, kLeastCorrelation, kGreatestOffsetS)};
  out.stations = stations_of(sensor, views, out.offset_s);
  return out;
}

}  // namespace birdseye::calibration
