#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/texture_matches.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Moves the views until the matches agree, by no more than tracked poses err: a bundle adjustment whose points lie on
/// the first view's rays, with Cauchy's loss, annealed, and a prior on the poses whose width is found from them. A
/// motion that all views have in common shows in no picture and stays. Empty where too few matches agree.
std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views,
                                            std::span<const TextureMatch> matches);

/// The same by what the views show of the surface: looked for near where the poses have it and, where little is found
/// there, further off.
std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface);

/// The view as it is seen from elsewhere.
PinholeView moved(PinholeView view, const Transform<Camera, Patient>& camera_from_patient);

/// Of a place of the patient, mm^2: what the poses' noise leaves of the views' common shift, turn and scale, which no
/// picture shows.
class CommonPoseError {
 public:
  CommonPoseError(const std::vector<PinholeView>& views, const PoseNoise& noise, const Eigen::Vector3d& about_mm);
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& place_mm) const;

 private:
  using Motion = Eigen::Matrix<double, 7, 7>;
  Eigen::Vector3d about_mm_;
  Motion covariance_;
};

}  // namespace birdseye::host
