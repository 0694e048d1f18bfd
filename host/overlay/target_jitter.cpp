#include "host/overlay/target_jitter.hpp"

#include <cmath>
#include <numeric>

namespace birdseye::host {

namespace {

constexpr Duration kGap = Duration::from_ms(130);
constexpr std::size_t kFewestPoses = 10, kMostPoses = 64;
constexpr Duration kTrack = Duration::from_ms(200);

}  // namespace

void TargetJitter::push(DeviceTime acquired, const Eigen::Vector3d& target_in_camera_mm) {
  if (!newest_.empty() && (acquired <= newest_.back().first || acquired - newest_.back().first > kGap)) newest_.clear();
  if (!track_.empty() && (acquired <= track_.back().first || acquired - track_.back().first > kGap)) track_.clear();
  track_.emplace_back(acquired, target_in_camera_mm);
  while (acquired - track_.front().first > kTrack) track_.pop_front();
  newest_.emplace_back(acquired, target_in_camera_mm);
  if (newest_.size() < 3) return;
  const auto& [t0, before] = newest_[0];
  const auto& [t1, middle] = newest_[1];
  const double u = (t1 - t0).seconds() / (acquired - t0).seconds();
  const Eigen::Vector3d off = middle - (1 - u) * before - u * target_in_camera_mm;
  squares_mm2_.push_back(off.squaredNorm() / (1 + (1 - u) * (1 - u) + u * u));  // the variances of all three add up
  if (squares_mm2_.size() > kMostPoses) squares_mm2_.pop_front();
  newest_.pop_front();
}

std::optional<double> TargetJitter::rms_mm() const {
  if (squares_mm2_.size() < kFewestPoses) return std::nullopt;
  return std::sqrt(std::accumulate(squares_mm2_.begin(), squares_mm2_.end(), 0.0) /
                   static_cast<double>(squares_mm2_.size()));
}

std::optional<double> TargetJitter::speed_mm_s() const {
  if (track_.size() < 3) return std::nullopt;
  const double count = static_cast<double>(track_.size());
  double mean_s = 0;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  for (const auto& [at, place_mm] : track_) {
    mean_s += (at - track_.front().first).seconds() / count;
    mean_mm += place_mm / count;
  }
  double squares_s2 = 0;
  Eigen::Vector3d sum_mm_s = Eigen::Vector3d::Zero();
  for (const auto& [at, place_mm] : track_) {
    const double since_s = (at - track_.front().first).seconds() - mean_s;
    squares_s2 += since_s * since_s;
    sum_mm_s += since_s * (place_mm - mean_mm);
  }
  return (sum_mm_s / squares_s2).norm();
}

}  // namespace birdseye::host
