#include "host/window/age_strip.hpp"

#include <algorithm>
#include <cmath>

namespace birdseye::host {

void AgeStrip::add(double age_ms) {
  ring_[count_ % kShown] = static_cast<float>(age_ms);
  ++count_;
  const double bin = std::clamp(std::floor(age_ms / kBinMs), 0.0, static_cast<double>(bins_.size() - 1));
  ++bins_[static_cast<std::size_t>(bin)];
  most_ms_ = std::max(most_ms_, age_ms);
}

std::vector<float> AgeStrip::newest() const {
  const std::size_t held = std::min(count_, kShown);
  std::vector<float> out;
  out.reserve(held);
  for (std::size_t i = count_ - held; i < count_; ++i) out.push_back(ring_[i % kShown]);
  return out;
}

double AgeStrip::percentile_ms(double part) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::size_t>(std::ceil(part * static_cast<double>(count_)));
  std::size_t sum = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    sum += bins_[i];
    if (sum >= std::max<std::size_t>(1, wanted)) return std::min(most_ms_, kBinMs * static_cast<double>(i + 1));
  }
  return most_ms_;
}

}  // namespace birdseye::host
