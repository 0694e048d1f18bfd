#pragma once

#include <span>

#include "host/registration/geometry/believed_deformation.hpp"

namespace birdseye::host {

/// By how many nats the points and matched points that a deformation was found by speak for the most believed one and
/// against an organ that lies as it did at rest; tempered as beliefs are. Negative where nothing moved.
double evidence_of_motion_nats(const SignedDistance& organ, std::span<const SeenPoint> points,
                               const BelievedDeformation& found, std::span<const MatchedPoint> matched = {});

}  // namespace birdseye::host
