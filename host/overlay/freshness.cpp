#include "host/overlay/freshness.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/texts/texts.hpp"

namespace birdseye::host {

Exposure exposure_of(const std::optional<RelatedTime<HostTime>>& stamped, Duration stamp_sigma, HostTime arrived) {
  constexpr std::int64_t kSurely = 3;  // sigmas
  constexpr Duration kClockReads = Duration::from_ms(1);
  if (!stamped) return {arrived, {}, words("why_clocks_unrelated")};
  const Duration sigma = in_quadrature(stamped->sigma, stamp_sigma), ahead = stamped->time - arrived;
  if (ahead.ns > kSurely * sigma.ns + kClockReads.ns)
    return {arrived, {}, words("why_stamp_ahead", ahead.seconds() * 1e3)};
  return {stamped->time, sigma, {}};
}

Freshness freshness_at(HostTime now, const Exposure& exposure, Duration pose_age, const FreshnessLimits& limits) {
  Freshness out;
  out.age = now - exposure.at;
  const HostTime exposed = exposure.at - Duration{2 * exposure.sigma.ns};
  const Duration age = now - exposed;
  out.stopped = age > limits.stopped;
  if (out.stopped) {
    out.why_too_old = words("why_stopped", age.seconds());
  } else if (age > limits.most_age) {
    out.why_too_old = words("why_old_picture", age.seconds() * 1e3);
  } else if (!exposure.doubt.empty()) {  // stamps that are ahead make poses look old, which are not
    out.why_too_old = exposure.doubt;
  } else if (pose_age > Duration{} && age + pose_age > limits.most_age) {
    out.why_too_old = words("why_old_pose", (age + pose_age).seconds() * 1e3);
  }
  out.overlaid_until = exposed + (limits.most_age - std::max(pose_age, Duration{})) + limits.late;
  out.bare_until = exposed + limits.stopped + limits.late;
  return out;
}

}  // namespace birdseye::host
