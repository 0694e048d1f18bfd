#pragma once

#include <string>

#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// When a picture is too old. Times are given, never read.
struct FreshnessLimits {
  /// No overlay where the frame, or the newest measurement behind its pose, is older than this. With what it takes to
  /// notice, less than 150 ms.
  Duration most_age = Duration::from_ms(120);
  /// A frame older than this is said to be stopped video.
  Duration stopped = Duration::from_ms(300);
  /// Whoever shows it is late where it is still on the screen so long after it grew too old: something else has to
  /// take it away.
  Duration late = Duration::from_ms(18);
};

/// How old a frame is.
struct Freshness {
  Duration age;             ///< from the middle of the exposure until now
  bool stopped = false;     ///< the video has stopped: it must not be taken for live
  std::string why_too_old;  ///< why it must not carry an overlay, in words; empty: it may
  /// From then on it must no longer be on the screen, with an overlay and without one.
  HostTime overlaid_until, bare_until;
};

/// exposed: the middle of the exposure. pose_age: how old the newest measurement behind the frame's pose was then; not
/// above zero where the pose was measured.
Freshness freshness_at(HostTime now, HostTime exposed, Duration pose_age, const FreshnessLimits& limits);

}  // namespace birdseye::host
