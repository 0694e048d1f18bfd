#include "drivers/minibird/bird_guard.hpp"

namespace birdseye::drivers::minibird {

BirdReading BirdGuard::judge(const Record& record, DeviceTime /*acquired*/, Duration /*sigma*/) {
  BirdReading reading;
  reading.button = record.button;
  if (auto pose = decode_pose(layout_.format, record.words, layout_.mm_per_count)) {
    reading.pose = *std::move(pose);
    reading.doubt.clear();
    reading.kind = Doubt::none;
  } else {
    reading.doubt = pose.error().what;
    reading.kind = Doubt::senseless;
  }
  return reading;
}

}  // namespace birdseye::drivers::minibird
