#pragma once

#include <optional>
#include <span>

#include "calibration/camera/camera_bundle.hpp"
#include "calibration/camera/camera_calibration.hpp"

namespace birdseye::calibration {

/// How the board seems to be bent, and what that does to the lens: z = s . (u^2, v^2, u v) over the board, u and v
/// being 1 at half its diagonal from its middle. Every view shows the same board, so that no view held out tells of it.
struct BoardSag {
  double sag_mm = 0;           ///< of the middle against the corners, at most along any line through the middle
  double standard_errors = 0;  ///< by which the three differ from 0: the root of an F of (3, views - 3)
  CameraVector lens_change = CameraVector::Zero();  ///< from the lens of a flat board to that of the bent one
};

/// By one step of Gauss-Newton from the fit with a flat board, in which the board's shape, the lens and all poses are
/// free; its standard error by a jackknife over the views, whose points may err together. Empty where the views do not
/// tell it, and of fewer than six views.
std::optional<BoardSag> find_board_sag(const CameraModel& camera, LensModel model, std::span<const BundleView> views);

}  // namespace birdseye::calibration
