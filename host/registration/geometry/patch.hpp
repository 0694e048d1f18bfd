#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

inline constexpr int kPatchSide = 13, kPatchSamples = kPatchSide * kPatchSide;
inline constexpr double kPatchFacing = 0.25;       ///< the least cosine of the surface's normal and the way to the eye
inline constexpr double kReferenceWidth_px = 768;  ///< of the picture that lengths in pixels are given for

/// A patch of one view and the plane that it is thought to lie in. Holds on to the view.
struct Patch {
  const PinholeView* view;
  double x_px, y_px, between_px, depth_mm;
  Eigen::Vector3d ray, place_mm, normal;
  std::array<float, kPatchSamples> texture;  ///< NaN where it does not count
};

/// A pixel of a view.
struct GridPixel {
  std::size_t view;
  int x_px, y_px;
};

/// The middles of patches that lie within their picture, every so many pixels of a picture kReferenceWidth_px wide:
/// view by view, row by row.
std::vector<GridPixel> patch_grid(const std::vector<PinholeView>& views, double every_px);

/// Empty where the view shows too little of the surface, or not from its front. depths: of the view.
std::optional<Patch> patch_at(const PinholeView& view, const DepthMap& depths, const SeenSurface& surface, int x_px,
                              int y_px);

/// A patch and another view that may show it. Holds on to both.
class PatchSeenBy {
 public:
  PatchSeenBy(const Patch& patch, const PinholeView& other);

  /// Normalised cross-correlation of the two, if the patch's plane is moved to a depth and the other view shows the
  /// patch beside_px from where the poses have it. NaN where the other view shows too little of it.
  [[nodiscard]] float correlation(double depth_mm, const Eigen::Vector2d& beside_px = Eigen::Vector2d::Zero()) const;

 private:
  using Samples = Eigen::Array<float, kPatchSamples, 1>;

  const Patch& patch_;
  const PinholeView& other_;
  Samples x_px_, y_px_;                      ///< of the patch, in its own view
  Eigen::Matrix3d far_, per_inverse_depth_;  ///< the view's pixels to the other's: far_ + per_inverse_depth_ / depth
};

}  // namespace birdseye::host
