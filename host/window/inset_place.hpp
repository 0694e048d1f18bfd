#pragma once

#include <Eigen/Core>
#include <optional>

namespace birdseye::host {

/// Where things lie on the screen, pixels from the video panel's upper left corner.
struct ScreenBox {
  Eigen::Vector2f from, to;
};
[[nodiscard]] bool overlap(const ScreenBox& a, const ScreenBox& b);

/// Where the inset goes: the corner where it was, or the next that leaves what must stay free (the target with its
/// circle and its figure) uncovered; empty where none does, and the inset is left out. area: that the inset may be in;
/// was: the corner of the frame before, 0 lower right, 1 lower left, 2 upper right, 3 upper left.
struct InsetPlace {
  int corner = 0;
  ScreenBox box;
};
std::optional<InsetPlace> place_inset(const ScreenBox& area, const Eigen::Vector2f& size,
                                      const std::optional<ScreenBox>& keep_free, int was);

}  // namespace birdseye::host
