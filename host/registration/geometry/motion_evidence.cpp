#include "host/registration/geometry/motion_evidence.hpp"

#include <array>

namespace birdseye::host {

double evidence_of_motion_nats(const SignedDistance& organ, std::span<const SeenPoint> points,
                               const BelievedDeformation& found, std::span<const MatchedPoint> matched) {
  constexpr double kNothing_mm = 0.05, kLength_mm = 120;
  constexpr std::array kScales_mm{1.0, 0.5};  // as deformations end
  DisplacementPrior nothing_moved;
  nothing_moved.parts.push_back({kLength_mm, kNothing_mm});
  const DisplacementFit none = DisplacementFit::solve(organ, points, nothing_moved, nullptr, kScales_mm, matched);
  return (found.fits.front().log_evidence() - none.log_evidence()) / kEvidenceTemper;
}

}  // namespace birdseye::host
