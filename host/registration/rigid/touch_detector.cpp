#include "host/registration/rigid/touch_detector.hpp"

#include <cmath>

namespace birdseye::host {

bool TouchDetector::window_is_still() const {
  // Slope of the least-squares line through the window, times the window's length.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double mean_s = 0;
  const DeviceTime start = window_.front().acquired;
  for (const Sample& s : window_) {
    mean += s.tip_mm;
    mean_s += (s.acquired - start).seconds();
  }
  const auto n = static_cast<double>(window_.size());
  mean /= n;
  mean_s /= n;
  Eigen::Vector3d covariance = Eigen::Vector3d::Zero();
  double variance = 0;
  for (const Sample& s : window_) {
    const double t = (s.acquired - start).seconds() - mean_s;
    covariance += t * (s.tip_mm - mean);
    variance += t * t;
  }
  return (covariance / variance).norm() * settings_.window.seconds() < settings_.still_mm;
}

std::optional<Touch> TouchDetector::finish_rest() {
  std::deque<Sample> rest;
  rest.swap(rest_);
  if (rest.back().acquired - rest.front().acquired < settings_.shortest) return std::nullopt;
  // The first and last sixth may hold the end of the approach and the start of the departure.
  const std::size_t trim = rest.size() / 6;
  const std::size_t n = rest.size() - 2 * trim;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = trim; i < trim + n; ++i) mean += rest[i].tip_mm;
  mean /= static_cast<double>(n);
  if (last_mm_ && (*last_mm_ - mean).norm() < settings_.apart_mm) return std::nullopt;
  double sum2 = 0;
  for (std::size_t i = trim; i < trim + n; ++i) sum2 += (rest[i].tip_mm - mean).squaredNorm();
  last_mm_ = mean;
  return Touch{mean, std::sqrt(sum2 / static_cast<double>(n)), static_cast<int>(n)};
}

std::optional<Touch> TouchDetector::push(DeviceTime acquired, const Eigen::Vector3d& tip_in_tracker_mm) {
  if (!window_.empty() && acquired <= window_.back().acquired) return std::nullopt;
  window_.push_back({acquired, tip_in_tracker_mm});
  while (acquired - window_.front().acquired > settings_.window) window_.pop_front();
  constexpr std::size_t kFewest = 8;
  const bool spans = (acquired - window_.front().acquired).seconds() > 0.8 * settings_.window.seconds();
  const bool followed = spans && window_.size() >= kFewest;
  if (!followed && rest_.empty()) return std::nullopt;

  // Where it was not seen for a while it may have been anywhere: a rest ends there.
  if (followed && window_is_still()) {
    if (rest_.empty()) {
      rest_.insert(rest_.end(), window_.begin(), window_.end());
    } else {
      rest_.push_back(window_.back());
    }
    return std::nullopt;
  }
  const bool counts = has_moved_;
  has_moved_ = has_moved_ || followed;
  if (rest_.empty()) return std::nullopt;
  if (!counts) {
    rest_.clear();
    return std::nullopt;
  }
  return finish_rest();
}

}  // namespace birdseye::host
