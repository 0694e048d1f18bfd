#pragma once

#include <span>

#include "calibration/base/result.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/registration/views/tissue.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// How far a place is from the boundary of the organ that the CT shows, on the grid that registration by geometry works
/// on. labels, values and transfer: as tissue_voxels() takes them. Errors are signed_distance_of()'s.
Result<SignedDistance> organ_distance(const Volume& ct, const Volume* labels, std::span<const int> values,
                                      const TransferFunction& transfer);

/// The same of the organ as a deformation has it.
SignedDistance deformed_distance(const SignedDistance& organ, const DisplacementField& field);

}  // namespace birdseye::host
