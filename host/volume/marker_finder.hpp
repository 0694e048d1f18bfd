#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "host/volume/marker_fit.hpp"

namespace birdseye::host {

struct MarkerSearch {
  MarkerShape shape;
  /// Markers are looked for among what is brighter than this. Unset: 300, 700 and 1500 HU in turn, which finds markers
  /// of plastic and of metal, and parts those that only touch.
  std::optional<std::int16_t> threshold_hu;
};

/// Looks like a marker, but its centre cannot be determined.
struct DoubtfulMarker {
  Eigen::Vector3d centre_in_patient_mm;
  std::string reason;
};

struct FoundMarkers {
  std::vector<MarkerFit> markers;        ///< brightest first
  std::vector<DoubtfulMarker> doubtful;  ///< cut by the border of the CT, or touching another
  int passed_over = 0;                   ///< bright things of about the size, of another shape
};

/// Finds markers of one shape in a CT. Connected voxels brighter than the threshold, together of about the marker's
/// size, are fitted (fit_marker), and taken for a marker where the shape explains them.
/// stop: ends the search; what was found until then is returned.
FoundMarkers find_markers(const Volume& ct, const MarkerSearch& search = {}, const std::stop_token& stop = {});

}  // namespace birdseye::host
