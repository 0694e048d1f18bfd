#include "hw-sim/phantom/procedural_head.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/phantom/shapes.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kNeckEndsZ = -132;
const Vector3d kTumourRadiiMm(13, 11, 12);

double subtracted(double from, double shape, double blend_mm) {
  return -smooth_union(-from, shape, blend_mm);
}

double face_mm(const Vector3d& p, const Vector3d& half, double d) {
  d = smooth_union(d, ellipsoid_mm(half, {34, -62, -34}, {22, 20, 22}), 18);         // cheeks
  d = smooth_union(d, ellipsoid_mm(p, {0, -68, -97}, {25, 15, 13}), 24);             // chin
  d = smooth_union(d, tapered_rod_mm(half, {8, -83, 11}, {44, -66, 10}, 6, 5), 10);  // brow
  d = subtracted(d, ellipsoid_mm(half, {31, -82, -5}, {16, 16, 12}), 8);             // eye sockets
  d = smooth_union(d, ellipsoid_mm(half, {31, -59, -5}, {12.5, 12.5, 12.5}), 2.5);   // eyes
  d = smooth_union(d, tapered_rod_mm(p, {0, -80, 4}, {0, -99, -36}, 5, 9.5), 9);     // bridge and tip of the nose
  d = smooth_union(d, ellipsoid_mm(half, {10, -91, -38}, {8, 10, 7}), 5);            // its wings
  d = subtracted(d, ellipsoid_mm(half, {6, -97, -47}, {3.2, 4.5, 6}), 2);            // nostrils
  d = smooth_union(d, ellipsoid_mm(p, {0, -83, -64}, {22, 8, 4.6}), 5);              // upper lip
  return smooth_union(d, ellipsoid_mm(p, {0, -82, -73}, {19, 8, 5.2}), 4);           // lower lip
}

double ear_mm(const Vector3d& half) {
  const double auricle = ellipsoid_mm(half, {68, 16, -12}, {9, 17, 28});
  return subtracted(auricle, ellipsoid_mm(half, {78, 11, -12}, {8, 9, 18}), 4);
}

double brain_mm(const Vector3d& p) {
  return ellipsoid_mm(p, {0, 6, 34}, {59, 79, 68});
}

double bone_mm(const Vector3d& p, const Vector3d& half) {
  const double skull = std::max(ellipsoid_mm(p, {0, 6, 34}, {65, 85, 74}), -brain_mm(p));
  const double jaw = std::min(tapered_rod_mm(half, {46, -2, -56}, {40, -30, -90}, 6, 7),
                              tapered_rod_mm(half, {40, -30, -90}, {4, -72, -98}, 7, 7));
  const double cheekbone = tapered_rod_mm(half, {28, -64, -26}, {60, -6, -16}, 6, 4);
  const double spine = tapered_rod_mm(p, {0, 36, -60}, {0, 42, -170}, 14, 14);
  return std::min({skull, jaw, cheekbone, spine});
}

/// Both sides of the circle of arteries under the brain, and what goes out of it.
VesselTree grow_arteries(std::uint64_t seed) {
  std::uint64_t draw = 0;
  const auto near = [&](double x, double y, double z) {
    Vector3d at(x, y, z);
    for (int axis = 0; axis < 3; ++axis) at[axis] += 6 * (hashed_uniform(seed + 51, draw++) - 0.5);
    return at;
  };
  VesselTree tree;
  const Vector3d basilar = near(0, 8, -8);
  tree.push_back({near(0, 24, -54), basilar, 3.2, 3});
  for (const double side : {-1.0, 1.0}) {
    const Vector3d posterior = near(side * 20, 36, 4);
    tree.push_back({basilar, posterior, 2.6, 2.2});
    tree.push_back({posterior, near(side * 28, 62, 18), 2.2, 1.8});
    const Vector3d siphon = near(side * 14, -8, -6);
    tree.push_back({near(side * 18, 2, -52), siphon, 3.2, 3});
    tree.push_back({siphon, basilar, 2, 2});
    const Vector3d middle = near(side * 38, -6, 8);
    tree.push_back({siphon, middle, 2.8, 2.4});
    tree.push_back({middle, near(side * 50, 14, 26), 2.4, 1.9});
    tree.push_back({middle, near(side * 44, 4, 52), 2.2, 1.8});
    const Vector3d anterior = near(side * 5, -46, 14);
    tree.push_back({siphon, anterior, 2.6, 2.2});
    tree.push_back({anterior, near(side * 5, -44, 46), 2.2, 1.9});
    tree.push_back({tree.back().b, near(side * 6, -16, 74), 1.9, 1.7});
  }
  return tree;
}

}  // namespace

double procedural_head_mm(const Vector3d& p) {
  const Vector3d half(std::abs(p.x()), p.y(), p.z());
  const double cranium = ellipsoid_mm(p, {0, 6, 34}, {73, 93, 82});
  double d = smooth_union(cranium, ellipsoid_mm(p, {0, -24, -40}, {54, 62, 76}), 34);
  d = face_mm(p, half, d);
  d = smooth_union(d, ear_mm(half), 5);
  d = smooth_union(d, tapered_rod_mm(p, {0, 26, -60}, {0, 38, -190}, 52, 56), 16);
  d = std::max(d, kNeckEndsZ - p.z());
  // No face is the mirror of itself.
  return d + 0.5 * std::sin(p.x() / 14.0 + 0.5) * std::sin(p.y() / 17.0 + 1.0) * std::sin(p.z() / 15.0 + 2.0);
}

Head procedural_head(std::uint64_t seed, const Grid& grid) {
  constexpr double kEdgeMm = 1.6;
  Head head;
  head.arteries = grow_arteries(seed);
  head.tumour_centre_mm = {26, -34, 44};
  for (int axis = 0; axis < 3; ++axis) {
    head.tumour_centre_mm[axis] += 8 * (hashed_uniform(seed + 52, static_cast<std::uint64_t>(axis)) - 0.5);
  }
  head.hu.resize(grid.voxels());
  head.labels.assign(grid.voxels(), 0);
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const Vector3d p = grid.point(i, j, k);
        const std::size_t at = grid.index(i, j, k);
        const Vector3d half(std::abs(p.x()), p.y(), p.z());
        double hu = -1000;
        const auto lay = [&](double distance, double value) { hu += (value - hu) * occupancy(distance, kEdgeMm); };
        const double skin = procedural_head_mm(p);
        if (skin < kEdgeMm) {
          lay(skin, 40);
          lay(ellipsoid_mm(half, {15, -60, -30}, {9, 12, 12}), -900);  // sinuses
          lay(bone_mm(p, half), 850);
          const double brain = brain_mm(p);
          lay(brain, 36);
          lay(ellipsoid_mm(half, {13, 6, 40}, {6, 32, 10}), 8);  // ventricles
          if (skin < 0) head.labels[at] = kHead;
          const double artery = distance_mm(head.arteries, p, kEdgeMm);
          const double tumour = ellipsoid_mm(p, head.tumour_centre_mm, kTumourRadiiMm);
          lay(artery, 260);
          lay(tumour, 130);
          if (artery < 0) head.labels[at] = kArtery;
          if (tumour < 0) head.labels[at] = kBrainTumour;
        }
        const double noisy = hu + 9.0 * hashed_normal(seed, at);
        head.hu[at] = static_cast<std::int16_t>(std::lround(std::clamp(noisy, -1024.0, 3071.0)));
      }
    }
  });
  return head;
}

}  // namespace birdseye::hw_sim
