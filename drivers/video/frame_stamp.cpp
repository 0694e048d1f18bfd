#include "drivers/video/frame_stamp.hpp"

#include <cmath>

namespace birdseye::drivers {

namespace {

// A stamp is taken in an interrupt, which others may delay.
constexpr double kStampSigma_ns = 100'000;

struct Uncertain {
  double mean_ns, sigma_ns;
};

/// Unknown: any time from none to a whole period is as likely as any other.
Uncertain span_of(const std::optional<Duration>& known, Duration period) {
  const auto whole_ns = static_cast<double>(period.ns);
  if (!known) return {whole_ns / 2, whole_ns / std::sqrt(12.0)};
  return {static_cast<double>(known->ns), 0};
}

}  // namespace

MidExposure mid_exposure(DeviceTime stamp, const StampMeaning& meaning) {
  const Uncertain exposure = span_of(meaning.exposure, meaning.period);
  Uncertain after{exposure.mean_ns / 2, exposure.sigma_ns / 2};
  if (!meaning.start_of_exposure) {
    const Uncertain readout = span_of(meaning.readout, meaning.period);
    after = {-after.mean_ns - readout.mean_ns, std::hypot(after.sigma_ns, readout.sigma_ns)};
  }
  return {stamp + Duration{std::llround(after.mean_ns)}, {std::llround(std::hypot(after.sigma_ns, kStampSigma_ns))}};
}

SequenceLine::Step SequenceLine::push(std::uint32_t count) {
  Step step;
  if (!last_count_) {
    after_first_zero_ = count == 0;
  } else {
    const std::uint32_t ahead = count - *last_count_;
    const bool counts = ahead != 0 && ahead < 0x8000'0000U;
    if (counts && !after_first_zero_) step.lost = ahead - 1;
    after_first_zero_ = false;
  }
  last_count_ = count;
  sequence_ += 1 + step.lost;
  step.sequence = sequence_;
  return step;
}

}  // namespace birdseye::drivers
