#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "calibration/geometry/camera_parameters.hpp"
#include "host/registration/geometry/seen_point.hpp"

namespace birdseye::host {

struct PinholeView;

/// The error of a view's lens as its calibration states it: independent errors of a standard deviation of 1, which are
/// some of those of all the views' lenses.
class LensError {
 public:
  /// factor: its product with its transpose is the covariance of the nine parameters. first: which of the errors of all
  /// lenses, in number `of`, are this lens's.
  LensError(const CameraModel& camera, Eigen::Matrix<double, CameraModel::kParameters, Eigen::Dynamic> factor,
            Eigen::Index first, Eigen::Index of);

  [[nodiscard]] Eigen::Index errors_of_all() const { return of_; }
  /// By how much a lens that is truly so sees a pixel's tissue elsewhere, in normalised coordinates, for each error of
  /// all lenses. direction: where the pixel is taken to look, normalised and undistorted.
  [[nodiscard]] Eigen::Matrix2Xd directions_by(const Eigen::Vector2d& direction) const;

 private:
  CameraModel camera_;
  Eigen::Matrix<double, CameraModel::kParameters, Eigen::Dynamic> factor_;
  Eigen::Index first_, of_;
};

/// Of each camera, by its covariance; without one its lens is taken for exact. Cameras that are the same to the last
/// digit are one lens, whose error all their views share. Null where no lens's error is known. covariances: none, or
/// one a camera.
std::vector<std::shared_ptr<const LensError>> lens_errors(std::span<const CameraModel> cameras,
                                                          std::span<const std::optional<CameraMatrix>> covariances);

/// How a place moves with the lenses' errors that was found where the views see it: to where all of them see it best
/// again, and no further than that asks for, as along the line of sight of a single view. No columns where no lens's
/// error is known.
ByLensErrors by_lens_errors(const Eigen::Vector3d& place_mm, std::span<const PinholeView* const> views);

}  // namespace birdseye::host
