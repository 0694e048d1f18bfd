#include "host/overlay/target_jitter.hpp"

#include <cmath>
#include <numeric>

namespace birdseye::host {

namespace {

constexpr Duration kGap = Duration::from_ms(130);
constexpr std::size_t kFewestPoses = 10, kMostPoses = 64;

}  // namespace

void TargetJitter::push(DeviceTime acquired, const Eigen::Vector3d& target_in_camera_mm) {
  if (!newest_.empty() && (acquired <= newest_.back().first || acquired - newest_.back().first > kGap)) newest_.clear();
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

}  // namespace birdseye::host
