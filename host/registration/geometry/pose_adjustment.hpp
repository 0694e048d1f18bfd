#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/texture_matches.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Moves the views until the matches agree: a bundle adjustment whose points lie on the first view's rays, with
/// Cauchy's loss, annealed, and a prior on each pose whose width is found from how far the views have to move. An error
/// that all poses share shows in no picture and stays. Empty where too few matches agree.
std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views,
                                            std::span<const TextureMatch> matches);

/// The same by matches of the surface's texture: looked for close to the rays and, where few are found there, further
/// from them.
std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface);

/// The error of a place of the patient, mm^2, by the shift, turn and scale that all views share: no picture shows
/// these, so that the poses' noise leaves them uncertain.
class CommonPoseError {
 public:
  CommonPoseError(const std::vector<PinholeView>& views, const PoseNoise& noise);
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& place_mm) const;

 private:
  using Motion = Eigen::Matrix<double, 7, 7>;
  Eigen::Vector3d about_mm_ = Eigen::Vector3d::Zero();  ///< the middle of the eyes
  Motion covariance_;
};

}  // namespace birdseye::host
