#pragma once

#include "host/deform/displacement_field.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The volume as it is seen deformed, on its own grid (docs/image-formation.md, Samples): at p it holds the volume at
/// p + u(p), trilinear, rounded to whole HU; -1024 where that lies outside.
Volume deformed_volume(const Volume& volume, const DisplacementField& field);

}  // namespace birdseye::host
