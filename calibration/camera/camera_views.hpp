#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/camera/camera_bundle.hpp"
#include "calibration/camera/camera_calibration.hpp"
#include "calibration/detect/pattern_view.hpp"

namespace birdseye::calibration {

/// A view that may be used, its points in the order of their numbers.
struct SoundView {
  std::size_t index = 0;  ///< among the views given
  std::string name;
  std::vector<int> ids;
  BundleView bundle;
};

struct SoundViews {
  std::vector<SoundView> views;
  std::vector<RejectedView> rejected;
};

/// Checks each view, and sorts views and points by what they hold. Sums are then added in the same order however the
/// views were handed over, so that results are the same to the bit.
Result<SoundViews> sort_out(std::span<const PatternView> views, int width_px, int height_px);

/// A first lens without distortion, whose fy is pixel_aspect of fx, and each view's pose with it. A view whose points
/// lie on no flat board is moved to `rejected` if robust. Errc::degenerate with fewer than three views.
Result<CameraModel> start_camera(SoundViews& views, int width_px, int height_px, double pixel_aspect, bool robust);

/// The error where too few views are usable: how many there are, and what was wrong with the others.
Error too_few_views(std::size_t usable, const std::vector<RejectedView>& rejected);

inline constexpr std::size_t kLeastViews = 3;

}  // namespace birdseye::calibration
