#pragma once

#include <string>

#include "drivers/system/progress.hpp"
#include "host/guide/hand_eye_guide.hpp"

namespace birdseye::host {

/// Settings of the guided procedure at an appliance.
struct LivePlan {
  std::string server = "127.0.0.1";  ///< HOST:PORT of the appliance
  GuidePlan guide;
  double seconds = 300;  ///< then it ends with what it has
};

/// Connects to the appliance, has the camera's controls held, and leads through the stations (HandEyeGuide) until the
/// verdict is pass, or the plan's limits. Errors: no appliance, one that falls silent, and what the guide refuses.
Result<GuidedStations> guide_hand_eye(const LivePlan& plan, Progress& progress);

}  // namespace birdseye::host
