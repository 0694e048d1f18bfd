#pragma once

#include <cstdint>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "hw-sim/case/subject.hpp"

namespace birdseye::hw_sim {

/// Places for a laparoscope about an organ at rest: the first looks at its middle from the front, the others from round
/// about, each about distance_mm from the surface, seeded.
std::vector<Transform<Camera, Patient>> choose_viewpoints(const Subject& subject, int count, double distance_mm,
                                                          std::uint64_t seed);

}  // namespace birdseye::hw_sim
