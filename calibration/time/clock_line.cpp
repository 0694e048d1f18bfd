#include "calibration/time/clock_line.hpp"

#include <algorithm>
#include <vector>

namespace birdseye {

std::int64_t ClockLine::offset_of(DeviceTime arrived) const {
  return arrived.ns - origin_ns_ - index_ * settings_.period.ns;
}

ClockLine::Tick ClockLine::push(DeviceTime arrived, std::int64_t lost) {
  if (index_ < 0) {
    origin_ns_ = arrived.ns;
    index_ = 0;
  } else {
    index_ += 1 + lost;
  }
  const std::int64_t period = settings_.period.ns;
  const std::int64_t late = period * 7 / 10;  // by so much, measurements may be missing
  const auto envelope = [this] { return *std::min_element(offsets_ns_.begin(), offsets_ns_.end()); };
  std::int64_t offset = offset_of(arrived);
  if (!offsets_ns_.empty()) {
    const std::int64_t over = offset - envelope();
    if (over < -period / 2) {
      // Earlier than can be: the count is ahead of the measurements. Begin again from here.
      offsets_ns_.clear();
      late_in_a_row_ = 0;
      ++restarts_;
    } else if (over > late) {
      if (++late_in_a_row_ >= settings_.slip_confirms) {
        // Late once is a busy machine; late every time is a measurement that never came.
        const auto recent = std::min(offsets_ns_.size(), settings_.slip_confirms - 1);
        std::int64_t least = offset;
        for (std::size_t i = 0; i < recent; ++i) least = std::min(least, offsets_ns_[offsets_ns_.size() - 1 - i]);
        const std::int64_t slipped = std::max<std::int64_t>(1, (least - envelope() + period / 2) / period);
        index_ += slipped;
        offset = offset_of(arrived);
        for (std::size_t i = 0; i < recent; ++i) offsets_ns_[offsets_ns_.size() - 1 - i] -= slipped * period;
        late_in_a_row_ = 0;
      }
    } else {
      late_in_a_row_ = 0;
    }
  }
  offsets_ns_.push_back(offset);
  if (offsets_ns_.size() > settings_.window) offsets_ns_.pop_front();

  std::vector<std::int64_t> sorted(offsets_ns_.begin(), offsets_ns_.end());
  const auto twentieth = static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), sorted.begin() + twentieth, sorted.end());
  const std::int64_t lowest = *std::min_element(sorted.begin(), sorted.begin() + twentieth + 1);
  Tick tick;
  tick.time = {origin_ns_ + index_ * period + lowest};
  tick.sigma = {sorted[static_cast<std::size_t>(twentieth)] - lowest};
  tick.late_by = {offset - lowest};
  // So late, and not yet confirmed: the machine was busy and the time is right, or measurements were lost and it is
  // wrong by what it is late. Who uses it must know.
  if (tick.late_by.ns > late) tick.sigma = tick.late_by;
  return tick;
}

}  // namespace birdseye
