#pragma once

#include "drivers/minibird/measurement.hpp"
#include "drivers/minibird/record_parser.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

/// Decides whether one bird's records make sense, each by itself and after the others.
class BirdGuard {
 public:
  BirdGuard(const BirdLayout& layout, const Plausibility& limits) : layout_(layout), limits_(limits) {}

  BirdReading judge(const Record& record, DeviceTime acquired, Duration sigma);

 private:
  BirdLayout layout_;
  Plausibility limits_;
};

}  // namespace birdseye::drivers::minibird
