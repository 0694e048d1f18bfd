#pragma once

#include "calibration/base/result.hpp"
#include "hw-sim/case/draw.hpp"
#include "hw-sim/case/shaped_moves.hpp"
#include "hw-sim/case/subject.hpp"

namespace birdseye::hw_sim {

/// The organ as an elastic body (ElasticBody) that drawn patches of its surface hold softly, as ligaments and great
/// vessels do, under drawn smooth tractions on its surface and gravity in a direction other than the CT's. Its size_mm
/// is how far that vertex of the surface moves that moves most. Refused where the body comes to no rest.
Result<DrawnMove> elastic(const OrganShape& organ, Draw& draw);

}  // namespace birdseye::hw_sim
