#include "host/operation/organ_motion.hpp"

#include <fmt/format.h>

#include "host/texts/texts.hpp"

namespace birdseye::host {

bool OrganMotion::take(const CheckedSurface& checked) {
  constexpr int kEnough = 2;
  constexpr Duration kTold = Duration::from_ms(10'000);
  const SurfaceFinding& finding = checked.finding;
  if (finding.verdict == SurfaceVerdict::cannot_tell) {
    if (!untold_since_) untold_since_ = checked.at;
    const Duration untold = checked.at - *untold_since_;
    if (untold < kTold) return false;
    told_ = false;
    line_ = words("note_cannot_tell", untold.seconds(), finding.words);
    return false;
  }
  untold_since_.reset();
  told_ = true;
  line_ = words("note_surface", finding.words);
  const bool moved = finding.verdict == SurfaceVerdict::moved;
  if (moved == moved_mm_.has_value()) {
    against_ = 0;
    return false;
  }
  if (++against_ < kEnough) return false;
  against_ = 0;
  moved_mm_ = moved ? finding.figure_mm : std::nullopt;
  return true;
}

}  // namespace birdseye::host
