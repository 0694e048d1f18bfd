#include "host/overlay/freshness.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/texts/texts.hpp"

namespace birdseye::host {

Freshness freshness_at(HostTime now, HostTime exposed, Duration pose_age, const FreshnessLimits& limits) {
  Freshness out;
  const Duration age = now - exposed;
  out.age = age;
  out.stopped = age > limits.stopped;
  if (out.stopped) {
    out.why_too_old = words("why_stopped", age.seconds());
  } else if (age > limits.most_age) {
    out.why_too_old = words("why_old_picture", age.seconds() * 1e3);
  } else if (pose_age > Duration{} && age + pose_age > limits.most_age) {
    out.why_too_old = words("why_old_pose", (age + pose_age).seconds() * 1e3);
  }
  out.overlaid_until = exposed + (limits.most_age - std::max(pose_age, Duration{})) + limits.late;
  out.bare_until = exposed + limits.stopped + limits.late;
  return out;
}

}  // namespace birdseye::host
