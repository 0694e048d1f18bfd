#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// A place of one view found again in another, wherever the poses say that it should be.
struct TextureMatch {
  std::size_t place = 0;  ///< matches of one place of one view share its number
  std::size_t view = 0;
  Eigen::Vector2d at_px;
  double depth_mm = 0;  ///< in the first view, as the other one has it along the ray
  std::size_t other_view = 0;
  Eigen::Vector2d other_px;
};

struct MatchSettings {
  double span_mm = 12;    ///< how far in front of and behind the surface a place is looked for, in depth
  double beside_px = 12;  ///< and how far beside where the poses have it, in pixels of a picture 768 wide
};

struct TextureMatches {
  std::vector<TextureMatch> found;
  std::size_t looked_for = 0;  ///< pairs of a place and another view
};

/// Patches of each view are looked for in the views nearest to it by their normalised cross-correlation, along the ray
/// and across it: what a wrong pose does to a picture is across the ray. Kept are peaks that are high and alone; some
/// of them are wrong.
TextureMatches texture_matches(const std::vector<PinholeView>& views, const SeenSurface& surface,
                               const MatchSettings& settings);

}  // namespace birdseye::host
