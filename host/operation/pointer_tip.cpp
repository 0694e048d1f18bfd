#include "host/operation/pointer_tip.hpp"

#include <cmath>

namespace birdseye::host {

namespace {

constexpr Duration kWindow = Duration::from_ms(250);
constexpr std::size_t kFewest = 5;

}  // namespace

std::optional<Touch> PointerTip::take(const wire::Birds& birds, const std::string& pointer,
                                      const Eigen::Vector3d& tip_in_pointer_mm) {
  std::optional<Touch> rested;
  if (!newest_.empty() && birds.acquired < newest_.back().first) *this = {};  // of another clock
  // Where it was when it was last seen is not where it is.
  while (!newest_.empty() && birds.acquired - newest_.front().first > kWindow) newest_.pop_front();
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != pointer) continue;
    const Eigen::Vector3d tip_in_tracker_mm = bird.tracker_from_sensor * tip_in_pointer_mm;
    newest_.emplace_back(birds.acquired, tip_in_tracker_mm);
    if (auto touch = detector_.push(birds.acquired, tip_in_tracker_mm)) rested = touch;
  }
  return rested;
}

std::optional<Touch> PointerTip::held() const {
  if (newest_.size() < kFewest) return std::nullopt;
  const auto count = static_cast<double>(newest_.size());
  Touch touch;
  touch.tip_in_tracker_mm.setZero();
  for (const auto& [time, tip] : newest_) touch.tip_in_tracker_mm += tip / count;
  double squares = 0;
  for (const auto& [time, tip] : newest_) squares += (tip - touch.tip_in_tracker_mm).squaredNorm();
  touch.rms_mm = std::sqrt(squares / count);
  touch.samples = static_cast<int>(newest_.size());
  return touch;
}

std::optional<Eigen::Vector3d> PointerTip::in_tracker_mm() const {
  if (newest_.empty()) return std::nullopt;
  return newest_.back().second;
}

}  // namespace birdseye::host
