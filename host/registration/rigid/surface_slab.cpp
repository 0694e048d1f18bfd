#include "host/registration/rigid/surface_slab.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rigid_matrix.hpp"

namespace birdseye::host {

namespace {

constexpr double kAir_hu = -1000, kTissue_hu = 100;
constexpr double kMargin_mm = 5;  ///< of air about the tissue, in which a deformation may move it
constexpr int kSubdivisions = 2;  ///< of a voxel along each axis, so that its share is smooth across the rim too

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = Eigen::Vector3d::Constant(-1e30);
  void add(const Eigen::Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

/// The share of tissue at a point, a voxel's width from none to all.
double share_at(const SurfaceIndex& index, const SlabSettings& settings, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d sight = point_mm - settings.seen_from_mm;
  const double distance_mm = sight.norm();
  if (distance_mm < 1e-9) return 0;
  const auto met_mm = index.first_hit_mm(settings.seen_from_mm, sight / distance_mm);
  if (!met_mm) return 0;
  const double behind_mm = distance_mm - *met_mm;
  const double front = std::clamp(0.5 + behind_mm / settings.spacing_mm, 0.0, 1.0);
  const double back = std::clamp(0.5 + (settings.depth_mm - behind_mm) / settings.spacing_mm, 0.0, 1.0);
  return std::min(front, back);
}

}  // namespace

Result<Volume> slab_behind(const Surface& surface, const SlabSettings& settings) {
  if (!(settings.spacing_mm > 0) || !(settings.depth_mm > 0) || !settings.seen_from_mm.allFinite())
    return Error{Errc::bad_value, "spacing and depth are lengths over 0 mm, and the eye is a point"};
  if (const double most_mm = settings.seen_from_mm.cwiseAbs().maxCoeff(); most_mm > kFarthestMm) {
    return Error{Errc::bad_value, fmt::format("the eye point is {:.6g} mm away, further than {:.0f} m: give it in mm",
                                              most_mm, kFarthestMm / 1000)};
  }
  const SurfaceIndex index(surface);
  Box box, surface_box;
  for (const Eigen::Vector3f& vertex : surface.vertices_mm) {
    const Eigen::Vector3d p = vertex.cast<double>();
    surface_box.add(p);
    box.add(p);
    box.add(p + settings.depth_mm * (p - settings.seen_from_mm).normalized());
  }
  if (const double across_mm = (surface_box.high - surface_box.low).maxCoeff(); across_mm < 2 * settings.spacing_mm) {
    return Error{Errc::bad_value, fmt::format("the surface is {:.3g} mm across; is it in metres? Give it in mm, or a "
                                              "smaller --spacing-mm",
                                              across_mm)};
  }
  constexpr double kMostBody_mm = 3000;
  if (const double across_mm = (surface_box.high - surface_box.low).maxCoeff(); !(across_mm <= kMostBody_mm)) {
    return Error{Errc::bad_value,
                 fmt::format("the surface is {:.3g} mm across, and no body is over {:g} mm; give it in "
                             "mm, without points that lie apart",
                             across_mm, kMostBody_mm)};
  }
  std::size_t met = 0;
  for (const auto& t : surface.triangles) {
    const Eigen::Vector3d centre =
        (surface.vertices_mm[t[0]] + surface.vertices_mm[t[1]] + surface.vertices_mm[t[2]]).cast<double>() / 3;
    const double distance_mm = (centre - settings.seen_from_mm).norm();
    if (distance_mm < 1e-6) continue;
    const auto hit_mm = index.first_hit_mm(settings.seen_from_mm, (centre - settings.seen_from_mm) / distance_mm);
    constexpr double kClose_mm = 0.01;
    if (hit_mm && std::abs(*hit_mm - distance_mm) < kClose_mm * (1 + 0.01 * distance_mm)) ++met;
  }
  if (10 * met < surface.triangles.size()) {
    return Error{Errc::bad_value,
                 fmt::format("only {} of {} triangles can be seen from {:g}, {:g}, {:g} mm; name another eye point",
                             met, surface.triangles.size(), settings.seen_from_mm.x(), settings.seen_from_mm.y(),
                             settings.seen_from_mm.z())};
  }
  box.low.array() -= kMargin_mm;
  box.high.array() += kMargin_mm;
  const Eigen::Vector3d count = ((box.high - box.low) / settings.spacing_mm).array().ceil() + 1;
  constexpr double kMost = 64e6;
  if (!(count.prod() <= kMost)) {
    return Error{Errc::bad_value, fmt::format("{:.0f} x {:.0f} x {:.0f} voxels are over 64 million; take a wider "
                                              "spacing",
                                              count.x(), count.y(), count.z())};
  }
  Volume out;
  out.size = {static_cast<int>(count.x()), static_cast<int>(count.y()), static_cast<int>(count.z())};
  out.spacing_mm.setConstant(settings.spacing_mm);
  out.patient_from_voxel.linear() = Eigen::Matrix3d(out.spacing_mm.asDiagonal());
  out.patient_from_voxel.translation() = box.low;
  out.hu.resize(grid_count(out.size));
  tbb::parallel_for(0, out.size[2], [&](int k) {
    for (int j = 0; j < out.size[1]; ++j) {
      for (int i = 0; i < out.size[0]; ++i) {
        double sum = 0;
        for (int part = 0; part < kSubdivisions * kSubdivisions * kSubdivisions; ++part) {
          const int di = part % kSubdivisions, dj = part / kSubdivisions % kSubdivisions;
          const int dk = part / (kSubdivisions * kSubdivisions);
          const Eigen::Vector3d offset(di, dj, dk);
          const Eigen::Vector3d at = Eigen::Vector3d(i, j, k) + (offset.array() + 0.5).matrix() / kSubdivisions -
                                     Eigen::Vector3d::Constant(0.5);
          sum += share_at(index, settings, out.patient_from_voxel * at);
        }
        const double share = sum / (kSubdivisions * kSubdivisions * kSubdivisions);
        out.hu[out.index(i, j, k)] = static_cast<std::int16_t>(std::lround(kAir_hu + share * (kTissue_hu - kAir_hu)));
      }
    }
  });
  return out;
}

}  // namespace birdseye::host
