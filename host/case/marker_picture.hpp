#pragma once

#include "host/files/picture.hpp"
#include "host/volume/marker_found.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Left the whole CT from the front with all markers numbered, right every marker in the three planes through its
/// centre, width_mm wide. Doubtful ones have a question mark and another colour.
Picture draw_markers(const Volume& ct, const FoundMarkers& found, double width_mm);

}  // namespace birdseye::host
