#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "host/registration/geometry/picture_parts.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// An earlier view, and what of the surface it sees.
struct EarlierView {
  PinholeView view;
  DepthMap depths;
  cv::Mat detail;  ///< float: how much brighter a pixel is than those about it, as a share; 0 where it does not count
};
EarlierView earlier_view(PinholeView view, const SeenSurface& surface);

/// How far a part of a later view shows the surface's texture from where earlier views say that it must be.
struct TextureShift {
  int part = 0;
  int places = 0;  ///< patches of the surface that an earlier view shows too
  /// Across the later view's line of sight: to the right, down. Empty where no shift is clearly likelier than others.
  std::optional<Eigen::Vector2d> shift_mm;
  /// How much of a shift it looks like, mm, where the surface lies one mm further out than it is believed to.
  double per_surface_mm = 0;
  double correlation = 0;  ///< of the likeliest shift
  double runner_up = 0;    ///< of the likeliest that lies apart from it
};

/// Of each part of the later view that shows some of what an earlier one does, from no other side: the one shift by
/// which all its patches together are most like the earlier views', by their weighed normalised cross-correlations.
/// Single patches tell little: most show a vessel that looks the same all along, or nothing. Looked for up to most_mm.
std::vector<TextureShift> texture_shifts(const std::vector<EarlierView>& earlier, const PinholeView& now,
                                         const SeenSurface& surface, double most_mm);

}  // namespace birdseye::host
