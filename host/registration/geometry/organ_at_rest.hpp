#pragma once

#include <memory>
#include <span>

#include "calibration/base/result.hpp"
#include "host/registration/geometry/elastic_modes.hpp"
#include "host/registration/views/tissue.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// What registration by geometry needs of an organ as the CT shows it: seconds of work, done once a CT and shared.
struct OrganAtRest {
  SignedDistance distance;
  std::shared_ptr<const ElasticModes> modes;
};

/// labels, values and transfer: as tissue_voxels() takes them. Errors are signed_distance_of()'s.
Result<std::shared_ptr<const OrganAtRest>> organ_at_rest(const Volume& ct, const Volume* labels,
                                                         std::span<const int> values, const TransferFunction& transfer);

}  // namespace birdseye::host
