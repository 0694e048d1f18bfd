#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/pinhole_view.hpp"

namespace birdseye::host {

/// How well one view bears out what the others say: the most believed hypothesis is fitted again without it, and the
/// surface is held against its outline and against stereo of it with the nearest other. Left out is the view of which
/// the others see most. touches, matched: what else the deformation was found by. Empty with fewer than three views,
/// and where too little is found to compare.
std::optional<HeldOutView> held_out_view(const SignedDistance& organ, const std::vector<PinholeView>& views,
                                         const BelievedDeformation& found, std::span<const SeenPoint> touches,
                                         std::span<const MatchedPoint> matched);

}  // namespace birdseye::host
