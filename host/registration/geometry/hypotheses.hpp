#pragma once

#include <array>
#include <memory>
#include <vector>

#include "host/registration/geometry/displacement_prior.hpp"
#include "host/registration/geometry/elastic_modes.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What may move an organ: long parts bend it, short ones follow what pushes it; forces within it, as an elastic body
/// gives way to them; and Bezier patches of so many inner control points, which hold still at the faces of the CT's
/// box.
std::vector<DisplacementPrior> hypotheses_of(const Volume& ct, const std::shared_ptr<const ElasticModes>& modes,
                                             const std::array<int, 3>& control_points);

/// What may move an organ that is pushed besides at one place, at rest, patient frame. inwards: from the surface there,
/// of unit length.
std::vector<DisplacementPrior> push_hypotheses_of(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& inwards);

}  // namespace birdseye::host
