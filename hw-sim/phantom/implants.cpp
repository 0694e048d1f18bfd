#include "hw-sim/phantom/implants.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/base/units.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/phantom/shapes.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kTumourDepthMm = 27, kThinnestHalfMm = 22;
constexpr double kPortalHu = 215, kHepaticHu = 170, kTumourHu = 350, kMarkerHu = 2500;

/// Grows one tree: each rod forks in two, in planes that alternate, until it is thin or would leave the liver.
class Grower {
 public:
  Grower(const Field& liver_mm, const Vector3d& centre, const Vector3d& keep_out, double keep_out_mm,
         std::uint64_t seed)
      : liver_mm_(liver_mm), centre_(centre), keep_out_(keep_out), keep_out_mm_(keep_out_mm), seed_(seed) {}

  VesselTree grow(const Vector3d& root, double radius_mm) {
    tree_.clear();
    branch(root, (centre_ - root).normalized(), Vector3d::UnitZ(), radius_mm, 0);
    return tree_;
  }

 private:
  double uniform(double low, double high) { return low + (high - low) * hashed_uniform(seed_, draws_++); }

  void branch(const Vector3d& from, Vector3d direction, const Vector3d& plane, double radius, int depth) {
    constexpr double kThinnestMm = 1.2;
    constexpr int kDeepest = 6;
    if (radius < kThinnestMm || depth > kDeepest) return;
    double length = radius * uniform(5.0, 7.0);
    Vector3d to = from + length * direction;
    const double thinner = radius * 0.82;
    for (int attempt = 0;
         liver_mm_(to) > -(radius + 2) || tapered_rod_mm(keep_out_, from, to, radius, thinner) < keep_out_mm_;
         ++attempt) {
      if (attempt == 8) return;
      direction = (direction + 0.3 * (centre_ - from).normalized()).normalized();
      length *= 0.88;
      to = from + length * direction;
    }
    tree_.emplace_back(from, to, radius, thinner);
    Vector3d across = plane.cross(direction);
    if (across.norm() < 0.1) across = direction.unitOrthogonal();
    across.normalize();
    for (const double side : {1.0, -1.0}) {
      const double angle = side * uniform(22, 44) * kRadPerDeg;
      const Vector3d twist = Eigen::AngleAxisd(uniform(-0.5, 0.5), direction) * across;
      branch(to, Eigen::AngleAxisd(angle, twist) * direction, across, thinner * uniform(0.9, 1.0), depth + 1);
    }
  }

  const Field& liver_mm_;
  Vector3d centre_, keep_out_;
  double keep_out_mm_;
  std::uint64_t seed_;
  std::uint64_t draws_ = 0;
  VesselTree tree_;
};

/// Marker centres: over the skin, at angles about the body (0 at the front, positive to the patient's left) and heights
/// about the liver. No two distances between them are alike, so that they are told apart without names.
std::vector<Vector3d> choose_markers(const Body& body, const Vector3d& liver_centre) {
  struct Place {
    double angle_deg, height_mm;
  };
  constexpr Place kPlaces[] = {{-72, 12}, {-38, 78}, {-8, 104}, {34, 58}, {-47, -66}, {17, -84}};
  const Vector3d low = body.grid.origin_mm;
  const Vector3d high = body.grid.last_mm();
  std::vector<Vector3d> markers;
  for (const Place& place : kPlaces) {
    const double z = std::clamp(liver_centre.z() + place.height_mm, low.z() + 14, high.z() - 14);
    const Vector3d axis(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), z);
    const double angle = place.angle_deg * kRadPerDeg;
    const Vector3d outward(std::sin(angle), -std::cos(angle), 0);
    const Vector3d touch = march_to_level(body.skin_mm, 0, axis + 320 * outward, -outward, 320);
    const Vector3d normal = gradient(body.skin_mm, touch, 2.0).normalized();
    Vector3d centre = touch + kMarkerRadiusMm * normal;
    // A CT cut close to the skin: the whole ball must lie in the picture.
    centre = centre.cwiseMax(low + Vector3d::Constant(7)).cwiseMin(high - Vector3d::Constant(7));
    markers.push_back(centre);
  }
  return markers;
}

}  // namespace

Rod::Rod(const Vector3d& from, const Vector3d& to, double radius_from_mm, double radius_to_mm)
    : a(from), b(to), radius_a_mm(radius_from_mm), radius_b_mm(radius_to_mm), middle(0.5 * (from + to)) {
  constexpr double kRounding_mm = 1e-6;
  reach_mm = 0.5 * (to - from).norm() + std::max(radius_from_mm, radius_to_mm) + kRounding_mm;
}

double distance_mm(const VesselTree& tree, const Vector3d& point, double at_most_mm) {
  double nearest = at_most_mm;
  for (const Rod& rod : tree) {
    const double within_mm = nearest + rod.reach_mm;
    if (within_mm < 0 || (point - rod.middle).squaredNorm() > within_mm * within_mm) continue;
    nearest = std::min(nearest, tapered_rod_mm(point, rod.a, rod.b, rod.radius_a_mm, rod.radius_b_mm));
  }
  return nearest;
}

Vector3d towards_scope() {
  return Vector3d(0.12, -0.66, -0.74).normalized();
}

Result<Implants> choose_implants(const Body& body, std::uint64_t seed) {
  const Grid coarse = Grid::around(body.grid.origin_mm, body.grid.last_mm(), 4.0);
  Vector3d sum = Vector3d::Zero();
  Vector3d deepest = Vector3d::Zero();
  double depth = 0;
  int inside = 0;
  for (int k = 0; k < coarse.size[2]; ++k) {
    for (int j = 0; j < coarse.size[1]; ++j) {
      for (int i = 0; i < coarse.size[0]; ++i) {
        const Vector3d p = coarse.point(i, j, k);
        const double d = body.liver_mm(p);
        if (d >= 0) continue;
        sum += p;
        ++inside;
        if (-d > depth) {
          depth = -d;
          deepest = p;
        }
      }
    }
  }
  if (depth < kThinnestHalfMm) {
    return Error{Errc::degenerate, "the CT holds no liver at least 44 mm thick; give one that does, or its --labels"};
  }
  Implants out;
  out.liver_centre_mm = sum / inside;
  // The centre of mass of a bent organ may lie near its surface; the tumour starts from where there is room.
  const double tumour_depth = std::min(kTumourDepthMm, 0.85 * depth);
  const Vector3d start = body.liver_mm(out.liver_centre_mm) < -tumour_depth ? out.liver_centre_mm : deepest;
  out.tumour_centre_mm = march_to_level(body.liver_mm, -tumour_depth, start, towards_scope(), 200, 0.5);
  for (int axis = 0; axis < 3; ++axis) {
    out.tumour_centre_mm[axis] += 3.0 * (hashed_uniform(seed, 900U + static_cast<unsigned>(axis)) - 0.5);
  }
  out.tumour_radii_mm = {12.5, 10.5, 11.5};

  // The trees spread from behind the tumour, which they go round.
  const Vector3d behind = march_to_level(body.liver_mm, -6, start, -towards_scope(), 200);
  const Vector3d heart = 0.4 * start + 0.6 * behind;
  const auto root = [&](const Vector3d& direction) {
    return march_to_level(body.liver_mm, -7, heart, direction.normalized(), 200);
  };
  const double keep_out_mm = out.tumour_radii_mm.maxCoeff() + 2;
  out.portal =
      Grower(body.liver_mm, heart, out.tumour_centre_mm, keep_out_mm, seed + 11).grow(root({0.62, 0.35, -0.45}), 5.6);
  out.hepatic =
      Grower(body.liver_mm, heart, out.tumour_centre_mm, keep_out_mm, seed + 12).grow(root({0.35, 0.30, 0.90}), 5.0);
  if (out.portal.size() < 8 || out.hepatic.size() < 8) {
    return Error{Errc::degenerate, "no vessel trees fit into the liver that was found; give the CT's organ --labels"};
  }
  out.markers_mm = choose_markers(body, out.liver_centre_mm);
  return out;
}

std::vector<std::uint8_t> implant(Body& body, const Implants& implants, std::uint64_t seed) {
  std::vector<std::uint8_t> labels(body.grid.voxels(), kBackground);
  const double edge_mm = body.grid.spacing_mm.mean();
  const auto blend = [&](std::int16_t& hu, double fraction, double value) {
    hu = static_cast<std::int16_t>(std::lround(hu + fraction * (value - hu)));
  };
  // Vessels are mixed, not overwritten, so the scan's own noise stays in them.
  tbb::parallel_for(0, body.grid.size[2], [&](int k) {
    for (int j = 0; j < body.grid.size[1]; ++j) {
      for (int i = 0; i < body.grid.size[0]; ++i) {
        const Vector3d p = body.grid.point(i, j, k);
        const std::size_t at = body.grid.index(i, j, k);
        std::int16_t& hu = body.hu[at];
        if (body.liver_mm(p) < 0) {
          labels[at] = kLiver;
          const double noise = 6.0 * hashed_normal(seed + 21, at);
          const double hepatic = distance_mm(implants.hepatic, p, edge_mm);
          const double portal = distance_mm(implants.portal, p, edge_mm);
          const double tumour = ellipsoid_mm(p, implants.tumour_centre_mm, implants.tumour_radii_mm);
          blend(hu, occupancy(hepatic, edge_mm), kHepaticHu + noise);
          blend(hu, occupancy(portal, edge_mm), kPortalHu + noise);
          blend(hu, occupancy(tumour, edge_mm), kTumourHu + noise);
          if (hepatic < 0) labels[at] = kHepatic;
          if (portal < 0) labels[at] = kPortal;
          if (tumour < 0) labels[at] = kTumour;
        }
        for (const Vector3d& marker : implants.markers_mm) {
          const Vector3d reach = body.grid.spacing_mm + Vector3d::Constant(kMarkerRadiusMm);
          if (((p - marker).cwiseAbs() - reach).maxCoeff() > 0) continue;
          // The exact share of the voxel, by counting: a fiducial must not move by the way it is drawn.
          constexpr int kParts = 7;
          int filled = 0;
          for (int part = 0; part < kParts * kParts * kParts; ++part) {
            const Eigen::Array3i cell(part % kParts, part / kParts % kParts, part / (kParts * kParts));
            const Vector3d offset = ((cell.cast<double>() + 0.5) / kParts - 0.5).matrix();
            if ((p + offset.cwiseProduct(body.grid.spacing_mm) - marker).norm() < kMarkerRadiusMm) ++filled;
          }
          blend(hu, filled / static_cast<double>(kParts * kParts * kParts), kMarkerHu);
        }
      }
    }
  });
  return labels;
}

}  // namespace birdseye::hw_sim
