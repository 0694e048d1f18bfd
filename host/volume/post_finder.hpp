#pragma once

#include <optional>
#include <stop_token>

#include "host/volume/hollow_post.hpp"
#include "host/volume/marker_found.hpp"

namespace birdseye::host {

struct PostSearch {
  /// Outer diameter, where the post is slim: within a third. Unset: any from 4 to kWidestPost_mm.
  std::optional<double> diameter_mm;
  /// A person has pointed at it: a post may then have open air on fewer sides.
  bool pointed_at = false;
};
inline constexpr double kWidestPost_mm = 16;
/// For posts of a shape.
inline PostSearch post_search(const MarkerShape& shape) {
  return {shape.diameter_mm > 0 ? std::optional(shape.diameter_mm) : std::nullopt, false};
}

/// Finds hollow posts: a cavity of air in a thin wall that stands in the open, held by a stalk. The cavity may have one
/// or two open ends. Cavities of the body (sinuses, ear canals, bowel, airways) have tissue or other cavities round
/// them, and are counted as passed over. stop: ends the search; what was found until then is returned.
FoundMarkers find_hollow_posts(const Volume& ct, const PostSearch& search, const std::stop_token& stop = {});

}  // namespace birdseye::host
