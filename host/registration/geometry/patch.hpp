#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

inline constexpr int kPatchSide = 13, kPatchSamples = kPatchSide * kPatchSide;
inline constexpr double kPatchFacing = 0.25;  ///< the least cosine of the surface's normal and the way to the eye
inline constexpr double kWidth_px = 768;      ///< of the pictures that lengths in pixels are given for

/// A patch of one view and the plane that it is thought to lie in. Holds on to the view.
struct Patch {
  const PinholeView* view;
  double x_px, y_px, between_px, depth_mm;
  Eigen::Vector3d ray, place_mm, normal;
  std::array<float, kPatchSamples> texture;  ///< NaN where it does not count
};

/// So far from a picture's border every patch's middle is.
int patch_margin_px(const PinholeView& view);

/// Empty where the view shows too little of the surface, or not from its front. depths: of the view.
std::optional<Patch> patch_at(const PinholeView& view, const DepthMap& depths, const SeenSurface& surface, int x_px,
                              int y_px);

/// Normalised cross-correlation of the patch with another view where its plane is moved to a depth, and where it is
/// found beside what the poses say: so many pixels. NaN where the other view shows too little of it.
float correlation(const Patch& patch, const PinholeView& other, double depth_mm,
                  const Eigen::Vector2d& beside_px = Eigen::Vector2d::Zero());

}  // namespace birdseye::host
