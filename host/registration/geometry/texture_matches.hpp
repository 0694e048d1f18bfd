#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// A place that one view shows and that was found in another view by its texture.
struct TextureMatch {
  std::size_t place = 0;  ///< matches of one place of one view share its number
  std::size_t view = 0;
  Eigen::Vector2d at_px;
  double depth_mm = 0;  ///< in the first view, by where the other view has the place along the ray
  std::size_t other_view = 0;
  Eigen::Vector2d other_px;
  double beside_px = 0;  ///< from the ray, in pixels of a picture 768 wide
};

struct MatchSettings {
  double span_mm = 12;    ///< how far in front of and behind the surface a place is looked for, in depth
  double beside_px = 12;  ///< how far from the ray a place is looked for, in pixels of a picture 768 wide
  double grid_px = 36;    ///< a patch every so many of these pixels
};

struct TextureMatches {
  std::vector<TextureMatch> found;
  std::size_t looked_for = 0;  ///< pairs of a place and another view
};

/// Of places that a pose takes off their rays, so far apart is that alike; in these pixels.
inline constexpr double kOffAlike_px = 6;

/// Looks for patches of each view in the views nearest to it, by their normalised cross-correlation, along the ray and
/// across it: only a wrong pose takes a place off the ray. Keeps peaks that are high and alone, and that are as far
/// from the ray as others of the same two views: a pose takes all places off alike. Some of the matches are wrong.
TextureMatches texture_matches(const std::vector<PinholeView>& views, const SeenSurface& surface,
                               const MatchSettings& settings);

}  // namespace birdseye::host
