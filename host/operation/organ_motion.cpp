#include "host/operation/organ_motion.hpp"

#include <fmt/format.h>

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kTold = Duration::from_ms(10'000);

}  // namespace

bool OrganMotion::told(HostTime now) const {
  return told_at_ && now - *told_at_ <= kTold;
}

std::string OrganMotion::line(HostTime now) const {
  const bool is_old = line_is_finding_ && told_at_ && !told(now);
  return is_old ? words("note_surface_old", (now - *told_at_).seconds()) : line_;
}

bool OrganMotion::take(const CheckedSurface& checked) {
  constexpr int kEnough = 2;
  const SurfaceFinding& finding = checked.finding;
  if (finding.verdict == SurfaceVerdict::cannot_tell) {
    if (!untold_since_) untold_since_ = checked.at;
    const Duration untold = checked.at - *untold_since_;
    if (untold < kTold) return false;
    line_is_finding_ = false;
    line_ = words("note_cannot_tell", untold.seconds(), finding.words);
    return false;
  }
  untold_since_.reset();
  line_is_finding_ = true;
  line_ = words("note_surface", finding.words);
  const bool moved = finding.verdict == SurfaceVerdict::moved;
  if (moved == moved_mm_.has_value()) {
    against_ = 0;
    told_at_ = checked.at;
    return false;
  }
  if (++against_ < kEnough) return false;
  against_ = 0;
  told_at_ = checked.at;
  moved_mm_ = moved ? finding.figure_mm : std::nullopt;
  return true;
}

}  // namespace birdseye::host
