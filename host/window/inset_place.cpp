#include "host/window/inset_place.hpp"

namespace birdseye::host {

bool overlap(const ScreenBox& a, const ScreenBox& b) {
  return (a.from.array() < b.to.array()).all() && (b.from.array() < a.to.array()).all();
}

std::optional<InsetPlace> place_inset(const ScreenBox& area, const Eigen::Vector2f& size,
                                      const std::optional<ScreenBox>& keep_free, int was) {
  constexpr int kCorners = 4;
  for (int next = 0; next < kCorners; ++next) {
    const int corner = (was + next) % kCorners;
    const bool left = corner % 2 == 1, upper = corner >= 2;
    const Eigen::Vector2f from(left ? area.from.x() : area.to.x() - size.x(),
                               upper ? area.from.y() : area.to.y() - size.y());
    const ScreenBox box{from, from + size};
    if (!keep_free || !overlap(box, *keep_free)) return InsetPlace{corner, box};
  }
  return std::nullopt;
}

}  // namespace birdseye::host
