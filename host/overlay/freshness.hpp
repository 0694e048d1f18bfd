#pragma once

#include <optional>
#include <string>

#include "calibration/time/clock.hpp"
#include "calibration/time/clock_relation.hpp"

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

/// When a frame was exposed, on this machine's clock.
struct Exposure {
  HostTime at{};        ///< the middle; where that is not to be believed, or not known, the frame's arrival
  Duration sigma{};     ///< of the clocks' relation and of the frame's stamp
  std::string doubt{};  ///< why its stamp is not believed, in words: it must not carry an overlay; empty: it is
};

/// stamped: where the clocks' relation has the frame's stamp; empty: the clocks are not related yet, and a frame that
/// has just come may be of any age. stamp_sigma: of the stamp. A frame that was exposed after it arrived, by more than
/// both sigmas allow, has a wrong stamp: by it video that has stopped would seem fresh.
Exposure exposure_of(const std::optional<RelatedTime<HostTime>>& stamped, Duration stamp_sigma, HostTime arrived);

/// pose_age: how old the newest measurement behind the frame's pose was at the exposure; not above zero where the pose
/// was measured. A frame counts as old as it may be with a probability of 95 %.
Freshness freshness_at(HostTime now, const Exposure& exposed, Duration pose_age, const FreshnessLimits& limits);

}  // namespace birdseye::host
