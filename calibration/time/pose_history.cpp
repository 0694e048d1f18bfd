#include "calibration/time/pose_history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye {

namespace {

/// Two samples give a line. Only those beyond two tell how far samples scatter about it.
constexpr std::ptrdiff_t kFewest = 4;

}  // namespace

const char* to_string(PoseKind kind) {
  switch (kind) {
    case PoseKind::exact:
      return "exact";
    case PoseKind::interpolated:
      return "interpolated";
    case PoseKind::predicted:
      return "predicted";
    case PoseKind::refused:
      break;
  }
  return "refused";
}

bool PoseHistory::push(DeviceTime acquired, Duration sigma, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  if (!samples_.empty() && acquired <= samples_.back().acquired) return false;
  samples_.push_back({acquired, sigma, tracker_from_sensor});
  if (samples_.size() > settings_.capacity) samples_.pop_front();
  return true;
}

std::optional<DeviceTime> PoseHistory::newest() const {
  if (samples_.empty()) return std::nullopt;
  return samples_.back().acquired;
}

PoseAnswer PoseHistory::at(DeviceTime time) const {
  PoseAnswer answer;
  if (samples_.empty()) {
    answer.reason = "the tracker has sent no pose yet";
    return answer;
  }
  answer.age = time - samples_.back().acquired;
  if (time < samples_.front().acquired) {
    answer.reason = "from before the oldest pose that is kept";
    return answer;
  }
  if (answer.age > settings_.max_prediction) {
    answer.reason = fmt::format("the newest pose is {:.0f} ms old", answer.age.seconds() * 1e3);
    return answer;
  }
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), time,
                                      [](const Sample& s, DeviceTime t) { return s.acquired < t; });
  if (after == samples_.end()) {
    answer.kind = PoseKind::predicted;
    answer.reason = fmt::format("{:.1f} ms past the newest pose", answer.age.seconds() * 1e3);
  } else if (after->acquired == time) {
    answer.kind = PoseKind::exact;
  } else {
    const Duration gap = after->acquired - std::prev(after)->acquired;
    if (gap > settings_.max_gap) {
      answer.reason = fmt::format("no pose for {:.0f} ms around this time", gap.seconds() * 1e3);
      return answer;
    }
    answer.kind = PoseKind::interpolated;
  }
  const Range range = around(time, after - samples_.begin());
  if (const auto count = range.end - range.begin;
      answer.kind == PoseKind::predicted && count < kFewest && answer.age.ns > 0) {
    answer.kind = PoseKind::refused;
    answer.reason = fmt::format("a prediction takes {} poses since the last gap, and there {} {}", kFewest,
                                count == 1 ? "is" : "are", count);
    return answer;
  }
  judge_time(range, answer);
  if (answer.kind == PoseKind::refused) return answer;
  fit(time, range, answer);
  if (settings_.smoothing.ns == 0 && answer.kind == PoseKind::exact) answer.tracker_from_sensor = after->pose;
  return answer;
}

PoseHistory::Range PoseHistory::around(DeviceTime time, std::ptrdiff_t first_after) const {
  const auto count = static_cast<std::ptrdiff_t>(samples_.size());
  const bool predicted = first_after == count;
  Range range;
  range.reference = std::min(first_after, count - 1);
  const bool exact = !predicted && sample(first_after).acquired == time;
  range.begin = exact || predicted ? range.reference : first_after - 1;
  range.end = range.reference + 1;
  const auto joined = [&](std::ptrdiff_t i) {
    return sample(i + 1).acquired - sample(i).acquired <= settings_.max_gap;
  };
  // For a prediction as many as tell how far they scatter, and the window's whole width before the newest.
  const Duration before_newest = std::max(settings_.smoothing + settings_.smoothing, settings_.least_predicted_from);
  const DeviceTime from = predicted ? sample(count - 1).acquired - before_newest : time - settings_.smoothing;
  const auto wanted = [&](std::ptrdiff_t i) {
    return sample(i).acquired >= from || (predicted && range.end - i <= kFewest);
  };
  while (range.begin > 0 && wanted(range.begin - 1) && joined(range.begin - 1)) --range.begin;
  while (range.end < count && sample(range.end).acquired - time <= settings_.smoothing && joined(range.end - 1)) {
    ++range.end;
  }
  return range;
}

/// Neighbouring samples' times err together: the clock that gave them is one. Their sigmas do not average out.
void PoseHistory::judge_time(const Range& range, PoseAnswer& answer) const {
  double squares = 0;
  for (std::ptrdiff_t i = range.begin; i < range.end; ++i) {
    const double sigma_s = sample(i).sigma.seconds();
    squares += sigma_s * sigma_s;
  }
  answer.time_sigma = Duration::from_seconds(std::sqrt(squares / static_cast<double>(range.end - range.begin)));
  if (answer.time_sigma <= settings_.max_time_sigma) return;
  answer.kind = PoseKind::refused;
  answer.reason = fmt::format("its time is sure to {:.1f} ms only, and {:.1f} ms are asked for",
                              answer.time_sigma.seconds() * 1e3, settings_.max_time_sigma.seconds() * 1e3);
}

void PoseHistory::fit(DeviceTime time, const Range& range, PoseAnswer& answer) const {
  const Transform<Tracker, Sensor>& reference = sample(range.reference).pose;
  using Row = Eigen::Matrix<double, 6, 1>;
  double weight = 0, st = 0, stt = 0;
  Row sum = Row::Zero(), sum_t = Row::Zero();
  const auto row_of = [&](const Sample& s) {
    Row row;
    row << s.pose.translation() - reference.translation(),
        rotation_log(reference.rotation().transpose() * s.pose.rotation());
    return row;
  };
  for (std::ptrdiff_t i = range.begin; i < range.end; ++i) {
    const double t = (sample(i).acquired - time).seconds();
    const Row row = row_of(sample(i));
    weight += 1;
    st += t;
    stt += t * t;
    sum += row;
    sum_t += t * row;
  }
  const double determinant = weight * stt - st * st;
  Row value = sum / weight;
  Row slope = Row::Zero();
  if (determinant > 1e-18) {
    slope = (weight * sum_t - st * sum) / determinant;
    value = (sum - slope * st) / weight;
  }
  if (range.end - range.begin >= kFewest) {
    double squares = 0;
    for (std::ptrdiff_t i = range.begin; i < range.end; ++i) {
      const double t = (sample(i).acquired - time).seconds();
      squares += (row_of(sample(i)) - value - t * slope).head<3>().squaredNorm();
    }
    // Variance of the fitted line at the time asked for, per axis.
    answer.position_sigma_mm = std::sqrt(squares / (3 * (weight - 2)) * (stt / determinant));
  }
  answer.speed_mm_s = slope.head<3>().norm();
  // What a constant acceleration does that the line does not know: past a window of width w it is off by
  // a (t^2 + t w + w^2 / 6) / 2, within a hole by a quarter of its square.
  double squares_s2 = 0;
  if (answer.kind == PoseKind::predicted) {
    const double ahead_s = answer.age.seconds();
    const double window_s = (sample(range.end - 1).acquired - sample(range.begin).acquired).seconds();
    squares_s2 = ahead_s * ahead_s + ahead_s * window_s + window_s * window_s / 6;
  } else if (answer.kind == PoseKind::interpolated) {
    const double hole_s = (sample(range.reference).acquired - sample(range.reference - 1).acquired).seconds();
    squares_s2 = hole_s * hole_s / 4;
  }
  answer.position_sigma_mm = std::hypot(answer.position_sigma_mm, 0.5 * settings_.acceleration_mm_s2 * squares_s2);
  answer.tracker_from_sensor =
      Transform<Tracker, Sensor>(Eigen::Matrix3d(reference.rotation() * rotation_exp(value.tail<3>())),
                                 Eigen::Vector3d(reference.translation() + value.head<3>()));
}

}  // namespace birdseye
