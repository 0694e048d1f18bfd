#pragma once

#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/registration/geometry/pinhole_view.hpp"
#include "host/registration/geometry/seen_point.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// Places of the surface that views see, where a registration by similarity has it: what shading and outlines say
/// together. Neighbours err alike, far more than they differ. organ: at rest; field: what the similarity found.
std::vector<SeenPoint> similarity_points(const std::vector<PinholeView>& views, const SignedDistance& organ,
                                         const DisplacementField& field);

}  // namespace birdseye::host
