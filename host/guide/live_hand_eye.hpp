#pragma once

#include <string>

#include "drivers/system/progress.hpp"
#include "host/guide/hand_eye_guide.hpp"
#include "host/link/event_source.hpp"

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

/// Takes a station of each rest of the scope over the pattern in a recording, up to the plan's most. Errors: a
/// recording that is damaged or has no poses of the plan's bird, and what the guide refuses.
Result<GuidedStations> stations_of_recording(EventSource& recording, const GuidePlan& plan, Progress& progress);

}  // namespace birdseye::host
