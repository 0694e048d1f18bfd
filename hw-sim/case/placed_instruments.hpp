#pragma once

#include <cstdint>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// So many straight instruments that come in from around the scope and end a few mm above an organ's surface near its
/// middle, in places drawn by the seed: shafts 5 mm across with a blunt tip. They stand still in all views. Refused
/// where one finds no way clear of the organ.
Result<Mesh> place_instruments(const Mesh& organ, const Eigen::Vector3d& towards_scope, int count, std::uint64_t seed);

}  // namespace birdseye::hw_sim
