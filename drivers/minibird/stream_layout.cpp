#include "drivers/minibird/stream_layout.hpp"

#include "drivers/minibird/measurement.hpp"

namespace birdseye::drivers::minibird {

std::size_t record_bytes(const StreamLayout& layout, std::size_t bird) {
  return 2 * word_count(layout.birds[bird].format) + (layout.button_byte ? 1 : 0) + (layout.group_mode ? 1 : 0);
}

std::size_t cycle_bytes(const StreamLayout& layout) {
  std::size_t bytes = 0;
  for (std::size_t bird = 0; bird < layout.birds.size(); ++bird) bytes += record_bytes(layout, bird);
  return bytes;
}

std::string_view name_of(DoubtKind doubt) {
  static constexpr std::array<std::string_view, kDoubtKinds> kNames = {
      "none",        "lost record", "senseless",       "saturated",         "beyond scale",
      "frozen",      "step",        "hemisphere flip", "hemisphere border", "outside hemisphere",
      "unconfirmed", "line noise",  "unmapped field",
  };
  return kNames[static_cast<std::size_t>(doubt)];
}

}  // namespace birdseye::drivers::minibird
