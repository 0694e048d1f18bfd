#include "host/registration/geometry/pose_adjustment.hpp"

#include <algorithm>
#include <array>

#include "calibration/base/units.hpp"

namespace birdseye::host {

namespace {

/// How far matches are looked for, and by how much poses may err there.
struct Reach {
  MatchSettings matches;
  PoseNoise widest;
};
/// Of exact poses, of those that were averaged, and of single records of a tracker whose sensor is far from the lens.
constexpr Reach kNear{.matches = {.span_mm = 12, .beside_px = 3, .grid_px = 36}, .widest = kUsualPoseNoise};
constexpr Reach kFurther{.matches = {.span_mm = 12, .beside_px = 12, .grid_px = 36}, .widest = kUsualPoseNoise};
constexpr Reach kFurthest{.matches = {.span_mm = 24, .beside_px = 48, .grid_px = 24}, .widest = kMostPoseNoise};

struct Adjusted {
  PoseAdjustment adjustment;
  std::size_t looked_for = 0;
  bool at_widest = false;  ///< the poses err by as much as was thought they might, or by more
  double right =
      0;  ///< about so many matches are right: of the wrong ones some agree by chance, more the nearer to rays
};

/// By matches that are looked for as the views are placed there. Of the views as they were given.
std::optional<Adjusted> adjusted_by(const MatchSettings& settings, const PoseNoise& widest,
                                    const std::vector<PinholeView>& views, const std::vector<PinholeView>& placed,
                                    const SeenSurface& surface) {
  const TextureMatches matches = texture_matches(placed, surface, settings);
  auto found = adjusted_poses(views, matches.found, widest);
  if (!found) return std::nullopt;
  const double chance = PoseBundle::kAgrees_px / std::min(settings.beside_px, kOffAlike_px);
  const double right =
      (static_cast<double>(found->poses.matches) - chance * static_cast<double>(matches.found.size())) / (1 - chance);
  const PoseNoise& noise = found->poses.noise;
  const bool at_widest = noise.eye_mm >= widest.eye_mm || noise.angle_rad >= widest.angle_rad;
  return Adjusted{*std::move(found), matches.looked_for, at_widest, right};
}

std::vector<PinholeView> moved_views(std::vector<PinholeView> views, const Adjusted& by) {
  for (std::size_t n = 0; n < views.size(); ++n)
    views[n] = moved(std::move(views[n]), by.adjustment.poses.camera_from_patient[n]);
  return views;
}

/// Patches overlap better once their views have moved: by matches of that reach, then by nearer ones, as long as more
/// are right.
std::optional<Adjusted> adjusted_within(const Reach& reach, std::span<const MatchSettings> nearer,
                                        const std::vector<PinholeView>& views, const SeenSurface& surface,
                                        const RegistrationWatch& watch) {
  constexpr int kMostTimes = 3;
  std::optional<Adjusted> best = adjusted_by(reach.matches, reach.widest, views, views, surface);
  for (const MatchSettings& settings : nearer) {
    for (int times = 0; best && times < kMostTimes && !watch.cancelled(); ++times) {
      auto again = adjusted_by(settings, reach.widest, views, moved_views(views, *best), surface);
      if (!again || again->right <= best->right) break;
      best = std::move(again);
    }
  }
  return best;
}

}  // namespace

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views,
                                             std::span<const TextureMatch> matches, const PoseNoise& widest) {
  constexpr std::size_t kFewest = 40;
  constexpr double kLeastShare = 0.4;
  constexpr PoseNoise kNarrowest{0.02, 0.005 * kRadPerDeg};
  constexpr std::array kScales{64.0, 16.0, 8.0, 4.0, 2.0};
  if (views.size() < 2 || matches.size() < kFewest) return std::nullopt;
  PoseBundle bundle(views, matches);
  PoseNoise noise = widest;
  for (const double scale : kScales) bundle.solve(noise, scale);
  for (int i = 0; i < 3; ++i) {
    const PoseNoise found = bundle.noise(noise, kScales.back());
    noise = {std::clamp(found.eye_mm, kNarrowest.eye_mm, widest.eye_mm),
             std::clamp(found.angle_rad, kNarrowest.angle_rad, widest.angle_rad)};
    bundle.solve(noise, kScales.back());
  }
  const std::size_t agreeing = bundle.agreeing();
  if (agreeing < kFewest || static_cast<double>(agreeing) < kLeastShare * static_cast<double>(matches.size()))
    return std::nullopt;
  return PoseAdjustment{{bundle.poses(), noise, agreeing}, bundle.common_error(noise, kScales.back())};
}

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                             const RegistrationWatch& watch) {
  constexpr double kEnough = 0.15;
  constexpr std::array kOfFurther{kNear.matches};
  constexpr std::array kOfFurthest{kFurther.matches, kNear.matches};
  std::optional<Adjusted> best;
  const auto enough = [&](std::optional<Adjusted> found) {
    if (found && (!best || best->at_widest || found->right > best->right)) best = std::move(found);
    return watch.cancelled() ||
           (best && !best->at_widest && best->right >= kEnough * static_cast<double>(best->looked_for));
  };
  if (!enough(adjusted_within(kNear, {}, views, surface, watch)) &&
      !enough(adjusted_within(kFurther, kOfFurther, views, surface, watch))) {
    enough(adjusted_within(kFurthest, kOfFurthest, views, surface, watch));
  }
  if (!best) return std::nullopt;
  return std::move(best->adjustment);
}

}  // namespace birdseye::host
