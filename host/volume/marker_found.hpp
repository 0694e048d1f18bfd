#pragma once

#include <string>
#include <vector>

#include "host/volume/marker_fit.hpp"

namespace birdseye::host {

/// Looks like a marker, but its centre cannot be determined.
struct DoubtfulMarker {
  Eigen::Vector3d centre_in_patient_mm;
  std::string reason;
};

struct FoundMarkers {
  std::vector<MarkerFit> markers;        ///< brightest first
  std::vector<DoubtfulMarker> doubtful;  ///< cut by the border of the CT, or disturbed by what is next to it
  int passed_over = 0;                   ///< things of about the size that are something else
};

}  // namespace birdseye::host
