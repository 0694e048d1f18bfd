#pragma once

#include <cstdint>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "hw-sim/case/subject.hpp"

namespace birdseye::hw_sim {

/// Chooses places for a laparoscope about an organ at rest, by the seed: the first looks at the organ's middle from the
/// front, the others from around that place, each about distance_mm from the surface.
std::vector<Transform<Camera, Patient>> choose_viewpoints(const Subject& subject, int count, double distance_mm,
                                                          std::uint64_t seed);

}  // namespace birdseye::hw_sim
