#pragma once

#include "host/deform/displacement_field.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// How far a place is from the boundary of an organ as a deformation has it.
SignedDistance deformed_distance(const SignedDistance& organ, const DisplacementField& field);

}  // namespace birdseye::host
