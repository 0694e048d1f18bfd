#include "host/operation/live_step.hpp"

#include <array>

namespace birdseye::host {

const char* name_of(LiveStep step) {
  constexpr std::array<const char*, kLiveSteps> kNames{"connect", "calibrate", "fiducials", "views",
                                                       "deform",  "check",     "run"};
  return kNames[static_cast<std::size_t>(step)];
}

}  // namespace birdseye::host
