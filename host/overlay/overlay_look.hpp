#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/render/scene/scene.hpp"

namespace birdseye::host {

enum class OverlayStyle {
  filled,    ///< shaded, as the engine draws it
  outlines,  ///< the outline of each structure alone: the video stays free within
};
/// "filled", "outlines".
std::string name_of(OverlayStyle style);

/// How an overlay is drawn, as whoever looks at it chooses.
struct OverlayLook {
  RenderSettings render;
  double opacity = 1;             ///< in [0, 1]
  bool surface_in_front = false;  ///< the surface's edges and highlights stay before it, so that it reads as inside
  OverlayStyle style = OverlayStyle::filled;
  /// Of a round hole about the picture's middle, as a part of the picture's height: the overlay shows in the hole
  /// alone, before a dark ground. Empty: no hole.
  std::optional<double> hole_radius;
  bool margins = true;  ///< where there are any
};

/// An overlay over a picture: out = overlay * strength + video * (1 - alpha * strength). video: RGB, rows from
/// the top. strength: as the gate decided, in [0, 1]. An overlay of another size than the picture's would lie somewhere
/// else, and is not drawn.
std::vector<std::uint8_t> lay_over(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength,
                                   const OverlayLook& look);

}  // namespace birdseye::host
