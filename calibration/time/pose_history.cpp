#include "calibration/time/pose_history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye {

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

bool PoseHistory::push(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  if (!samples_.empty() && acquired <= samples_.back().acquired) return false;
  samples_.push_back({acquired, tracker_from_sensor});
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
  if (settings_.smoothing.ns == 0 && answer.kind == PoseKind::exact) {
    answer.tracker_from_sensor = after->pose;
  } else {
    fit(time, answer);
  }
  return answer;
}

void PoseHistory::fit(DeviceTime time, PoseAnswer& answer) const {
  // The samples of the window; at least the two that surround the time, or the last two.
  const auto first_after = std::lower_bound(samples_.begin(), samples_.end(), time,
                                            [](const Sample& s, DeviceTime t) { return s.acquired < t; });
  const auto mid = static_cast<std::ptrdiff_t>(first_after - samples_.begin());
  const auto count = static_cast<std::ptrdiff_t>(samples_.size());
  std::ptrdiff_t begin = std::clamp<std::ptrdiff_t>(mid - 1, 0, std::max<std::ptrdiff_t>(0, count - 2));
  std::ptrdiff_t end = std::min(begin + 2, count);
  const auto sample = [&](std::ptrdiff_t i) -> const Sample& { return samples_[static_cast<std::size_t>(i)]; };
  while (begin > 0 && time - sample(begin - 1).acquired <= settings_.smoothing) --begin;
  while (end < count && sample(end).acquired - time <= settings_.smoothing) ++end;

  const Transform<Tracker, Sensor>& reference = sample(std::min(mid, count - 1)).pose;
  using Row = Eigen::Matrix<double, 6, 1>;
  double weight = 0, st = 0, stt = 0;
  Row sum = Row::Zero(), sum_t = Row::Zero();
  const auto row_of = [&](const Sample& s) {
    Row row;
    row << s.pose.translation() - reference.translation(),
        rotation_log(reference.rotation().transpose() * s.pose.rotation());
    return row;
  };
  for (std::ptrdiff_t i = begin; i < end; ++i) {
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
  if (weight > 3) {
    double squares = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const double t = (sample(i).acquired - time).seconds();
      squares += (row_of(sample(i)) - value - t * slope).head<3>().squaredNorm();
    }
    // Variance of the fitted line at the time asked for, per axis.
    answer.position_sigma_mm = std::sqrt(squares / (3 * (weight - 2)) * (stt / determinant));
  }
  answer.tracker_from_sensor =
      Transform<Tracker, Sensor>(Eigen::Matrix3d(reference.rotation() * rotation_exp(value.tail<3>())),
                                 Eigen::Vector3d(reference.translation() + value.head<3>()));
}

}  // namespace birdseye
