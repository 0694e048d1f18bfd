#include "host/registration/geometry/pose_adjustment.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace birdseye::host {

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views,
                                             std::span<const TextureMatch> matches) {
  constexpr std::size_t kFewest = 40;
  constexpr double kLeastShare = 0.4;
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr PoseNoise kWidest{2, 0.5 * kDegree}, kNarrowest{0.02, 0.005 * kDegree};
  constexpr std::array kScales{8.0, 4.0, 2.0};
  if (views.size() < 2 || matches.size() < kFewest) return std::nullopt;
  PoseBundle bundle(views, matches);
  PoseNoise noise = kWidest;
  for (const double scale : kScales) bundle.solve(noise, scale);
  for (int i = 0; i < 3; ++i) {
    const PoseNoise found = bundle.noise(noise, kScales.back());
    noise = {std::clamp(found.eye_mm, kNarrowest.eye_mm, kWidest.eye_mm),
             std::clamp(found.angle_rad, kNarrowest.angle_rad, kWidest.angle_rad)};
    bundle.solve(noise, kScales.back());
  }
  const std::size_t agreeing = bundle.agreeing();
  if (agreeing < kFewest || static_cast<double>(agreeing) < kLeastShare * static_cast<double>(matches.size()))
    return std::nullopt;
  return PoseAdjustment{{bundle.poses(), noise, agreeing}, bundle.common_error(noise, kScales.back())};
}

std::optional<PoseAdjustment> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface) {
  constexpr double kNear_px = 3, kFar_px = 12, kMany = 0.2;
  MatchSettings settings;
  settings.beside_px = kNear_px;
  const TextureMatches near = texture_matches(views, surface, settings);
  const auto few = [&](const std::optional<PoseAdjustment>& found) {
    return !found || static_cast<double>(found->poses.matches) < kMany * static_cast<double>(near.looked_for);
  };
  auto found = adjusted_poses(views, near.found);
  if (!few(found)) return found;
  settings.beside_px = kFar_px;
  auto further = adjusted_poses(views, texture_matches(views, surface, settings).found);
  if (!further || (found && further->poses.matches <= found->poses.matches)) return found;
  // Patches overlap better once their views have moved.
  settings.beside_px = kNear_px;
  std::vector<PinholeView> there;
  for (std::size_t n = 0; n < views.size(); ++n)
    there.push_back(moved(views[n], further->poses.camera_from_patient[n]));
  auto again = adjusted_poses(views, texture_matches(there, surface, settings).found);
  return again && again->poses.matches > further->poses.matches ? again : further;
}

}  // namespace birdseye::host
