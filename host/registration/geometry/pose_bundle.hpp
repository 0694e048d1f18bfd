#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/common_pose_error.hpp"
#include "host/registration/geometry/texture_matches.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// A bundle adjustment: views, and places that were matched between two of them, each on its view's ray.
class PoseBundle {
 public:
  /// views and matches stay the caller's, and must outlive the bundle.
  PoseBundle(const std::vector<PinholeView>& views, std::span<const TextureMatch> matches);

  /// Changes poses and depths until the matches agree, from where they are. noise: of the poses as they were given.
  /// scale: of Cauchy's loss, in standard deviations of a match.
  void solve(const PoseNoise& noise, double scale);

  /// From the next solve() on, the focal lengths of all views may err by one share, which is found with the rest.
  /// sigma: of that share, before anything is seen.
  void find_focal_error(double sigma);
  /// What is found of it; none of it where it was not asked for.
  [[nodiscard]] FocalError focal_error(const PoseNoise& noise, double scale) const;
  /// From the next solve() on, nothing is known of that view's pose before: the others have to say where it is.
  void set_free(std::size_t view);

  /// What the width of the poses' prior is to be, by the changes under a prior of the given width: the sum of their
  /// squares over the number of freedoms that the matches determine (D. MacKay, Bayesian interpolation, 1992). Of the
  /// views that are not free.
  [[nodiscard]] PoseNoise noise(const PoseNoise& prior, double scale) const;
  /// What matches and prior leave open of the motion that all matched places share. A narrow base leaves more open than
  /// shift, turn and scale of the eyes: that the cameras turn towards one another looks almost like another distance.
  [[nodiscard]] CommonPoseError common_error(const PoseNoise& noise, double scale) const;

  /// Matches that are nearer than this to where their views have them, in pixels of a picture 768 wide.
  static constexpr double kAgrees_px = 1.5;
  [[nodiscard]] std::size_t agreeing() const;
  [[nodiscard]] std::size_t agreeing(std::size_t view) const;  ///< those of a view
  [[nodiscard]] std::vector<Transform<Camera, Patient>> poses() const;
  /// By how much a view's pose has changed: its eye's way, and the camera's turn.
  [[nodiscard]] PoseMove moved_by(std::size_t view) const;
  /// The length of that change in standard deviations, of what the matches leave open of it and of the noise that its
  /// pose is thought to have had.
  [[nodiscard]] double deviations(std::size_t view, const PoseNoise& noise, double scale) const;
  /// Where the matched places lie, by their numbers; of a number that no match has, the origin.
  [[nodiscard]] std::vector<Eigen::Vector3d> places_mm() const;

 private:
  /// What a pose is changed by: a turn of the camera about its eye, camera frame, and the eye's shift, patient mm.
  using Change = std::array<double, 6>;
  /// A place's depth in the normal equations of all changes, where it is eliminated.
  struct Place {
    Eigen::RowVectorXd by_changes;
    double by_depth = 0;
  };
  /// The changes' covariance, and the places' rows by which their depths follow.
  struct Posterior {
    Eigen::MatrixXd covariance;
    std::vector<Place> places;
  };
  [[nodiscard]] Posterior posterior(const PoseNoise& noise, double scale) const;
  /// Of a view's pose: what is known of all of them, or of a free one.
  [[nodiscard]] PoseNoise known_of(std::size_t view, const PoseNoise& noise) const;
  [[nodiscard]] Eigen::Index unknowns() const;
  [[nodiscard]] bool agrees(const TextureMatch& match) const;
  /// Of the match in its view's camera, unit depth, by the focal lengths that were found.
  [[nodiscard]] Eigen::Vector3d ray_of(const TextureMatch& match) const;

  const std::vector<PinholeView>& views_;
  std::span<const TextureMatch> matches_;
  std::vector<Change> changes_;
  std::vector<double> depths_mm_;
  double log_focal_ = 0;    ///< of the true focal lengths over the given ones
  double focal_sigma_ = 0;  ///< 0: they are held
  std::optional<std::size_t> free_;
};

}  // namespace birdseye::host
