#pragma once

#include <optional>
#include <string>

#include "calibration/time/clock.hpp"
#include "host/registration/geometry/surface_check.hpp"

namespace birdseye::host {

/// A check of a frame against the deformed surface.
struct CheckedSurface {
  SurfaceFinding finding;
  HostTime at;  ///< when the frame came
};

/// What such checks come to, one after the other. One odd frame changes nothing: two that say the same do, one after
/// the other, whatever lies between them that cannot tell.
class OrganMotion {
 public:
  /// True: the organ has moved, or is back where it was.
  bool take(const CheckedSurface& checked);

  /// By the check that said so; empty: it is not said that it has moved.
  [[nodiscard]] const std::optional<double>& moved_mm() const { return moved_mm_; }
  /// What was found last; where it could not be told for ten seconds, or nothing was checked for so long, that, and
  /// why.
  [[nodiscard]] std::string line(HostTime now) const;
  /// A check could tell within the last ten seconds: one frame by which it cannot be told, or that says otherwise,
  /// changes nothing.
  [[nodiscard]] bool told(HostTime now) const;
  /// Nothing is to be said yet: no check could tell, and not for ten seconds either.
  [[nodiscard]] bool unchecked() const { return line_.empty(); }

 private:
  std::optional<double> moved_mm_;
  std::string line_;
  bool line_is_finding_ = false;
  std::optional<HostTime> told_at_;       ///< when the last frame came that bears out what is said
  int against_ = 0;                       ///< checks in a row that say otherwise
  std::optional<HostTime> untold_since_;  ///< from when on no check could tell
};

}  // namespace birdseye::host
