#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibration/base/units.hpp"
#include "host/registration/geometry/pose_bundle.hpp"
#include "host/registration/geometry/texture_matches.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Corrected poses, and the error that all of them may still share.
struct PoseAdjustment {
  AdjustedPoses poses;
  CommonPoseError common;
};

/// The most that poses err by which a cart averages.
inline constexpr PoseNoise kUsualPoseNoise{2, 0.5 * kRadPerDeg};
/// The most that poses may err by and be corrected: those of single records of a tracker, far from the lens. Eyes that
/// seem to be off by as much were not corrected rightly; of angles that was not found so.
inline constexpr PoseNoise kMostPoseNoise{4, 0.6 * kRadPerDeg};

/// Moves the views until the matches agree: a bundle adjustment whose points lie on the first view's rays, with
/// Cauchy's loss, annealed, and a prior on each pose whose width is found from how far the views have to move. An error
/// that all poses share shows in no picture and stays. widest: the most that poses are thought to err by. Empty where
/// too few matches agree.
std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views,
                                             std::span<const TextureMatch> matches,
                                             const PoseNoise& widest = kUsualPoseNoise);

/// The same by matches of the surface's texture: looked for close to the rays and, where few are found there, further
/// from them.
std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                             const RegistrationWatch& watch = {});

}  // namespace birdseye::host
