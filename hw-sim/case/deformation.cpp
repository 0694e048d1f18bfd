#include "hw-sim/case/deformation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "hw-sim/case/elastic_move.hpp"
#include "hw-sim/case/forward_map.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 8> kNames = {"elastic",     "bezier", "bend",      "push",
                                                    "compression", "twist",  "breathing", "pneumoperitoneum"};

Result<DrawnMove> draw_move(const OrganShape& organ, const DeformationSettings& settings, Draw& draw) {
  switch (settings.kind) {
    case DeformationKind::bend:
      return bend(organ, draw);
    case DeformationKind::push:
      return push(organ, settings.push_width_mm, draw);
    case DeformationKind::compression:
      return compression(organ, draw);
    case DeformationKind::twist:
      return twist(organ, draw);
    case DeformationKind::breathing:
      return breathing(organ, draw);
    case DeformationKind::pneumoperitoneum:
      return pneumoperitoneum(organ, draw);
    case DeformationKind::elastic:
    case DeformationKind::bezier:
      break;
  }
  return elastic(organ, draw);
}

/// The size at which the surface moves by amplitude_mm; 0 where none is found.
double fitted_size_mm(const DrawnMove& drawn, const Mesh& surface, double amplitude_mm) {
  constexpr int kScalings = 20;
  constexpr double kCloseEnough = 1e-6;
  double size_mm = amplitude_mm;
  for (int scaling = 0; scaling < kScalings; ++scaling) {
    double most_mm = 0;
    for (const Eigen::Vector3f& v : surface.vertices)
      most_mm = std::max(most_mm, drawn.move_mm(v.cast<double>(), size_mm).norm());
    if (!(most_mm > 0) || !std::isfinite(most_mm)) return 0;
    if (std::abs(most_mm / amplitude_mm - 1) < kCloseEnough) return size_mm;
    size_mm *= amplitude_mm / most_mm;
  }
  return 0;
}

bool stays_within(const TissueMap& map, const Mesh& surface) {
  return std::all_of(surface.vertices.begin(), surface.vertices.end(), [&](const Eigen::Vector3f& v) {
    const Vector3d now = map.deformed_of(v.cast<double>());
    return (now - map.low_mm()).minCoeff() > 0 && (map.high_mm() - now).minCoeff() > 0;
  });
}

Result<DrawnDeformation> draw_patch(const OrganShape& organ, const DeformationSettings& settings, std::uint64_t seed) {
  const BezierMap still(organ.grid.origin_mm, organ.grid.last_mm(), settings.inner);
  auto map = BezierMap::random(still, settings.amplitude_mm, organ.surface.vertices, seed);
  if (!map) return map.error();
  auto patch = std::make_unique<const BezierMap>(*std::move(map));
  const BezierMap* const seen = patch.get();
  return DrawnDeformation{std::move(patch), seen, {}};
}

}  // namespace

std::string name_of(DeformationKind kind) {
  return std::string(kNames[static_cast<std::size_t>(kind)]);
}

Result<std::array<int, 3>> parse_dof(const std::string& text) {
  constexpr int kMost = BezierMap::kMostInner;
  std::array<int, 3> inner{};
  int read = 0;
  int dof = 0;
  if (std::sscanf(text.c_str(), "%dx%dx%d%n", inner.data(), &inner[1], &inner[2], &read) == 3 &&
      static_cast<std::size_t>(read) == text.size()) {
    if (*std::min_element(inner.begin(), inner.end()) >= 1 && *std::max_element(inner.begin(), inner.end()) <= kMost)
      return inner;
  } else if (std::sscanf(text.c_str(), "%d%n", &dof, &read) == 1 && static_cast<std::size_t>(read) == text.size()) {
    for (int n = 1; n <= kMost; ++n) {
      if (dof == 3 * n * n * n) return std::array<int, 3>{n, n, n};
    }
  }
  return Error{Errc::bad_value, fmt::format("--dof {}: give 3, 24, 81, 192, 375, 648 or 1029, or inner control points "
                                            "an axis, 1 to {}, as 3x3x3",
                                            text, kMost)};
}

Result<void> parse_deformation(const std::string& kind, const std::string& dof, DeformationSettings& settings) {
  if (!kind.empty()) {
    const auto* const found = std::find(kNames.begin(), kNames.end(), kind);
    if (found == kNames.end())
      return Error{Errc::bad_value, fmt::format("--deformation {}: there are {}", kind, fmt::join(kNames, ", "))};
    settings.kind = static_cast<DeformationKind>(found - kNames.begin());
  }
  if (dof.empty()) return {};
  if (!kind.empty() && settings.kind != DeformationKind::bezier)
    return Error{Errc::bad_value,
                 fmt::format("--dof {}: belongs to bezier; give it without --deformation {}", dof, kind)};
  const auto inner = parse_dof(dof);
  if (!inner) return inner.error();
  settings.kind = DeformationKind::bezier;
  settings.inner = *inner;
  return {};
}

Result<DrawnDeformation> draw_deformation(const OrganShape& organ, const DeformationSettings& settings,
                                          std::uint64_t seed) {
  if (settings.kind == DeformationKind::bezier || settings.amplitude_mm == 0) return draw_patch(organ, settings, seed);
  constexpr int kDraws = 10;
  Draw draw(seed + 62);
  for (int i = 0; i < kDraws; ++i) {
    auto drawn = draw_move(organ, settings, draw);
    if (!drawn) return drawn.error();
    const double size_mm = fitted_size_mm(*drawn, organ.surface, settings.amplitude_mm);
    if (size_mm == 0) continue;
    auto map = std::make_unique<const ForwardMap>(
        organ.grid.origin_mm, organ.grid.last_mm(),
        [move = drawn->move_mm, size_mm](const Vector3d& rest) { return move(rest, size_mm); });
    if (!stays_within(*map, organ.surface) || map->least_determinant() <= TissueMap::kLeastDeterminant) continue;
    drawn->numbers.push_back({"size_mm", {size_mm}});
    return DrawnDeformation{std::move(map), nullptr, std::move(drawn->numbers)};
  }
  return Error{Errc::bad_value,
               fmt::format("a deformation of kind {} that moves the organ by {:g} mm folds its tissue or "
                           "takes it out of its CT; give less",
                           name_of(settings.kind), settings.amplitude_mm)};
}

}  // namespace birdseye::hw_sim
