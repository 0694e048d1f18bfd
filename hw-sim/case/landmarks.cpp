#include "hw-sim/case/landmarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/case/draw.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr std::size_t kSurfacePoints = 40, kFewestSurfacePoints = 30, kVesselPoints = 24;

/// Up to so many of the points, each as far from those before it as can be.
std::vector<Vector3d> spread_out(const std::vector<Vector3d>& points, std::size_t most) {
  std::vector<Vector3d> chosen;
  std::vector<double> apart(points.size(), std::numeric_limits<double>::max());
  std::size_t next = 0;
  while (chosen.size() < std::min(most, points.size())) {
    chosen.push_back(points[next]);
    for (std::size_t i = 0; i < points.size(); ++i)
      apart[i] = std::min(apart[i], (points[i] - chosen.back()).squaredNorm());
    next = static_cast<std::size_t>(std::max_element(apart.begin(), apart.end()) - apart.begin());
  }
  return chosen;
}

/// Vertices at rest, by whether some view sees them where they are now.
struct SampledSurface {
  std::vector<Vector3d> seen, hidden;
};

/// Out of a seeded sample.
SampledSurface sample_surface(const Subject& subject, const Mesh& deformed, const Laparoscope& scope,
                              std::span<const Transform<Camera, Patient>> views, std::uint64_t seed) {
  constexpr std::uint64_t kSample = 4000;
  SampledSurface out;
  const auto vertices = static_cast<double>(deformed.vertices.size());
  for (std::uint64_t i = 0; i < kSample; ++i) {
    const auto v = static_cast<std::size_t>(vertices * hashed_uniform(seed + 81, i));
    const bool visible = std::any_of(views.begin(), views.end(), [&](const Transform<Camera, Patient>& view) {
      return scope.sees(view, deformed.vertices[v].cast<double>(), deformed.normals[v].cast<double>());
    });
    (visible ? out.seen : out.hidden).push_back(subject.surface.vertices[v].cast<double>());
  }
  return out;
}

}  // namespace

Result<std::vector<TrueLandmark>> choose_landmarks(const Subject& subject, const Mesh& deformed, const TissueMap& map,
                                                   const Laparoscope& scope,
                                                   std::span<const Transform<Camera, Patient>> views,
                                                   std::uint64_t seed) {
  const SampledSurface sampled = sample_surface(subject, deformed, scope, views, seed);
  const auto surface = spread_out(sampled.seen, kSurfacePoints);
  if (surface.size() < kFewestSurfacePoints) {
    return Error{Errc::degenerate, fmt::format("the views see {} points of the organ's surface where {} are needed; "
                                               "give another --distance-mm or more --views",
                                               surface.size(), kFewestSurfacePoints)};
  }
  std::vector<Vector3d> inner;
  for (const Rod& rod : subject.vessels) {
    inner.push_back(rod.b);
    inner.emplace_back(0.5 * (rod.a + rod.b));
  }
  std::vector<TrueLandmark> landmarks;
  const auto add = [&](std::string name, const Vector3d& rest) {
    landmarks.push_back({std::move(name), rest, map.deformed_of(rest)});
  };
  const auto add_all = [&](const char* kind, const std::vector<Vector3d>& points) {
    for (std::size_t i = 0; i < points.size(); ++i) add(fmt::format("{}_{:02}", kind, i + 1), points[i]);
  };
  add_all("surface", surface);
  add_all("vessel", spread_out(inner, kVesselPoints));
  add("tumour", subject.tumour_centre_mm);
  add_all("hidden", spread_out(sampled.hidden, surface.size()));
  return landmarks;
}

Result<std::vector<Vector3d>> choose_touches(const Subject& subject, const Mesh& deformed, const TissueMap& map,
                                             const Laparoscope& scope,
                                             std::span<const Transform<Camera, Patient>> views, int count,
                                             double noise_mm, std::uint64_t seed) {
  constexpr std::uint64_t kOther = 523;
  const auto most = static_cast<std::size_t>(count);
  std::vector<Vector3d> touches =
      spread_out(sample_surface(subject, deformed, scope, views, seed + kOther).hidden, most);
  if (touches.size() < most) {
    return Error{Errc::degenerate, fmt::format("--touches: the views leave {} places of the organ unseen where {} are "
                                               "to be touched; give fewer --touches or fewer --views",
                                               touches.size(), most)};
  }
  Draw draw(seed + 2 * kOther);
  for (Vector3d& touch : touches) {
    const Vector3d exact_mm = map.deformed_of(touch);
    const double x = draw.normal(), y = draw.normal();
    touch = exact_mm + noise_mm * Vector3d(x, y, draw.normal());
  }
  return touches;
}

}  // namespace birdseye::hw_sim
