#include "host/registration/geometry/pose_adjustment.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace birdseye::host {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// How far matches are looked for, and by how much poses may err there.
struct Reach {
  MatchSettings matches;
  PoseNoise widest;
};
/// Exact poses, those that were averaged, and single records of a tracker whose sensor is far from the lens.
constexpr std::array kReaches{Reach{{12, 3}, kUsualPoseNoise}, Reach{{12, 12}, kUsualPoseNoise},
                              Reach{{24, 48}, {4, 0.6 * kDegree}}};

struct Adjusted {
  PoseAdjustment adjustment;
  std::size_t looked_for = 0;
  /// How many matches more agree than would by chance: the closer to the rays they were looked for, the more would.
  double beyond_chance = 0;
};

/// By matches that are looked for as the views are placed there. Of the views as they were given.
std::optional<Adjusted> adjusted_by(const Reach& reach, const std::vector<PinholeView>& views,
                                    const std::vector<PinholeView>& placed, const SeenSurface& surface) {
  const TextureMatches matches = texture_matches(placed, surface, reach.matches);
  auto found = adjusted_poses(views, matches.found, reach.widest);
  if (!found) return std::nullopt;
  const double chance = std::min(1.0, PoseBundle::kAgrees_px / reach.matches.beside_px);
  const double beyond_chance =
      static_cast<double>(found->poses.matches) - chance * static_cast<double>(matches.found.size());
  return Adjusted{*std::move(found), matches.looked_for, beyond_chance};
}

std::vector<PinholeView> moved_views(std::vector<PinholeView> views, const Adjusted& by) {
  for (std::size_t n = 0; n < views.size(); ++n)
    views[n] = moved(std::move(views[n]), by.adjustment.poses.camera_from_patient[n]);
  return views;
}

}  // namespace

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views,
                                             std::span<const TextureMatch> matches, const PoseNoise& widest) {
  constexpr std::size_t kFewest = 40;
  constexpr double kLeastShare = 0.4;
  constexpr PoseNoise kNarrowest{0.02, 0.005 * kDegree};
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

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface) {
  constexpr double kEnough = 0.15;
  constexpr int kMostTimes = 3;
  std::optional<Adjusted> best;
  const auto take_better = [&](std::optional<Adjusted> other) {
    if (!other || (best && other->beyond_chance <= best->beyond_chance)) return false;
    best = std::move(other);
    return true;
  };
  for (std::size_t n = 0; n < kReaches.size(); ++n) {
    const Reach& reach = kReaches[n];
    if (take_better(adjusted_by(reach, views, views, surface)) && n > 0) {
      // Patches overlap better once their views have moved.
      const auto again = [&](const Reach& nearer) {
        return take_better(adjusted_by({nearer.matches, reach.widest}, views, moved_views(views, *best), surface));
      };
      for (int times = 0; n > 1 && times < kMostTimes && again(kReaches[1]);) ++times;
      for (int times = 0; times < kMostTimes && again(kReaches[0]);) ++times;
    }
    if (best && best->beyond_chance >= kEnough * static_cast<double>(best->looked_for)) break;
  }
  if (!best) return std::nullopt;
  return std::move(best->adjustment);
}

}  // namespace birdseye::host
