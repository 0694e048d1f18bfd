#include "host/registration/geometry/view_agreement.hpp"

#include <algorithm>
#include <array>

#include "calibration/base/units.hpp"
#include "host/registration/geometry/pose_adjustment.hpp"
#include "host/registration/geometry/pose_bundle.hpp"

namespace birdseye::host {

namespace {

constexpr double kScale = 2;  ///< of Cauchy's loss, in standard deviations of a match
constexpr PoseNoise kNarrowest{0.02, 0.005 * kRadPerDeg};
/// Wider than poses are thought to err where they are adjusted: what is wrong here is to show.
constexpr PoseNoise kWidest{8, 2 * kRadPerDeg};

/// Solves the bundle, and finds how far poses err by it. Starts from noise.
PoseNoise solved(PoseBundle& bundle, PoseNoise noise) {
  constexpr std::array kScales{16.0, 4.0, kScale};
  constexpr int kTimes = 4;
  for (const double scale : kScales) bundle.solve(noise, scale);
  for (int i = 0; i < kTimes; ++i) {
    const PoseNoise found = bundle.noise(noise, kScale);
    noise = {std::clamp(found.eye_mm, kNarrowest.eye_mm, kWidest.eye_mm),
             std::clamp(found.angle_rad, kNarrowest.angle_rad, kWidest.angle_rad)};
    bundle.solve(noise, kScale);
  }
  return noise;
}

/// The view, if the others put it elsewhere than its pose does, by more than they leave open and than their own poses
/// err. Nothing is said of a view with few matches, and where the others do not agree among themselves either.
std::optional<OddView> odd_view(const std::vector<PinholeView>& given, std::span<const TextureMatch> matches,
                                const PoseNoise& noise) {
  constexpr double kDeviations = 8, kLeastEye_mm = 2, kLeastTurn_rad = kRadPerDeg;
  constexpr std::size_t kFewest = 20;
  std::optional<OddView> out;
  double most = kDeviations;
  for (std::size_t n = 0; n < given.size(); ++n) {
    PoseBundle bundle(given, matches);
    bundle.set_free(n);
    const PoseNoise others = solved(bundle, noise);
    const PoseMove off = bundle.moved_by(n);
    if (off.eye_mm < kLeastEye_mm && off.turn_rad < kLeastTurn_rad) continue;
    if (others.eye_mm > kUsualPoseNoise.eye_mm || others.angle_rad > kUsualPoseNoise.angle_rad) continue;
    if (bundle.agreeing(n) < kFewest) continue;
    const double deviations = bundle.deviations(n, others, kScale);
    if (deviations <= most) continue;
    most = deviations;
    out = OddView{n, off, others};
  }
  return out;
}

}  // namespace

std::optional<ViewAgreement> view_agreement(const std::vector<PinholeView>& given,
                                            std::span<const TextureMatch> matches) {
  constexpr std::size_t kFewest = 40, kFewestViews = 3;
  constexpr PoseNoise kStart{1, 0.25 * kRadPerDeg};
  constexpr double kFocalSigma = 0.2;
  if (given.size() < 2 || matches.size() < kFewest) return std::nullopt;
  ViewAgreement out;
  PoseBundle bundle(given, matches);
  bundle.find_focal_error(kFocalSigma);
  const PoseNoise noise = solved(bundle, kStart);
  out.matches = bundle.agreeing();
  if (out.matches < kFewest) return std::nullopt;
  out.focal = bundle.focal_error(noise, kScale);
  if (given.size() >= kFewestViews) out.odd = odd_view(given, matches, kStart);
  return out;
}

std::optional<ViewAgreement> view_agreement(const std::vector<PinholeView>& given,
                                            const std::vector<PinholeView>& placed, const SeenSurface& surface) {
  constexpr std::size_t kMany = 200;
  TextureMatches matches;
  for (const double grid_px : {36.0, 18.0}) {
    matches = texture_matches(placed, surface, {.span_mm = 6, .beside_px = 3, .grid_px = grid_px});
    if (matches.found.size() >= kMany) break;
  }
  return view_agreement(given, matches.found);
}

}  // namespace birdseye::host
