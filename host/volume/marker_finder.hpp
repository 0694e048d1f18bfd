#pragma once

#include <optional>
#include <stop_token>

#include "host/volume/marker_found.hpp"

namespace birdseye::host {

struct MarkerSearch {
  MarkerShape shape;
  /// Markers are looked for among what is brighter than this. Unset: 300, 700 and 1500 HU in turn, which finds markers
  /// of plastic and of metal, and parts those that only touch.
  std::optional<std::int16_t> threshold_hu;
};

/// Finds markers of one shape in a CT. Connected voxels brighter than the threshold, together of about the marker's
/// size, are fitted (fit_marker), and taken for a marker where the shape explains them. Posts are found by their
/// cavities (find_hollow_posts); the threshold does not count for them.
/// stop: ends the search; what was found until then is returned.
FoundMarkers find_markers(const Volume& ct, const MarkerSearch& search = {}, const std::stop_token& stop = {});

/// Markers of the shape, but of another size.
struct OtherSize {
  double diameter_mm = 0;
  int count = 0;
};

/// Which other size the most markers of this shape have, at least three: what was asked for where its size was wrong.
/// Sizes from a fifth to five times as large are looked for. Empty where there are no three; not of posts.
std::optional<OtherSize> other_size(const Volume& ct, const MarkerSearch& search, const std::stop_token& stop = {});

}  // namespace birdseye::host
