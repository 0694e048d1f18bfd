#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/phantom/body.hpp"
#include "hw-sim/phantom/shapes.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

// Sizes in mm about a body axis at x = y = 0; x to the patient's left, y to the back, z to the head.
constexpr double kFatMm = 14, kMuscleMm = 10;
constexpr double kSpineY = 60;

double skin_mm(const Vector3d& p) {
  const double waist = 1.0 + 0.05 * std::cos(p.z() / 110.0);
  const Vector3d flat(p.x(), p.y(), 0);
  return ellipsoid_mm(flat, Vector3d(0, 0, 0), Vector3d(158 * waist, 108 * waist, 1e6));
}

double liver_mm(const Vector3d& p) {
  const double right = ellipsoid_mm(p, {-66, -4, 22}, {70, 74, 80});
  const double left = ellipsoid_mm(p, {8, -36, 46}, {66, 36, 40});
  const double bed = ellipsoid_mm(p, {-34, -42, -52}, {20, 26, 40});  // where the gallbladder lies
  double d = smooth_union(right, left, 30);
  d = -smooth_union(-d, bed, 12);
  // The visceral face is cut by a slanting plane; the wall bounds the rest.
  const double visceral = (Vector3d(p) - Vector3d(-20, 10, -32)).dot(Vector3d(0.42, 0.30, -0.86));
  d = -smooth_union(-d, -visceral, 18);
  d = std::max(d, skin_mm(p) + kFatMm + kMuscleMm + 3);
  return d + 1.1 * std::sin(p.x() / 11.0) * std::sin(p.y() / 13.0 + 1.0) * std::sin(p.z() / 12.0 + 2.0);
}

double spine_mm(const Vector3d& p) {
  const double round = std::hypot(p.x(), p.y() - kSpineY) - 21;
  const double spinous = std::max(
      {std::abs(p.x()) - 4.0, std::abs(p.y() - kSpineY - 30) - 14.0, std::abs(std::remainder(p.z(), 34.0)) - 8.0});
  return std::min(round, spinous);
}

double ribs_mm(const Vector3d& p) {
  if (p.z() < -40 || std::abs(p.x()) < 25) return 1e3;
  const double along_wall = skin_mm(p) + kFatMm + 0.5 * kMuscleMm;
  const double slanted = p.z() + 0.35 * p.y();
  return std::hypot(along_wall, std::remainder(slanted, 26.0)) - 5.0;
}

struct Organ {
  Vector3d centre, radii;
  double hu;
};

const Organ kOrgans[] = {
    {{62, 46, -46}, {25, 24, 50}, 185},   // left kidney
    {{-62, 50, -72}, {25, 24, 50}, 185},  // right kidney
    {{98, 34, 48}, {30, 42, 52}, 120},    // spleen
    {{56, -26, 36}, {42, 34, 44}, 25},    // stomach
    {{-34, -42, -52}, {15, 20, 32}, 8},   // gallbladder
};

/// HU before noise; each tissue is laid over what lies under it with a soft edge, as partial volume does.
double tissue_hu(const Vector3d& p) {
  constexpr double kEdgeMm = 1.6;
  const double skin = skin_mm(p);
  double hu = -1000;
  if (skin > kEdgeMm) return hu;
  const auto lay = [&](double distance, double value) { hu += (value - hu) * occupancy(distance, kEdgeMm); };
  lay(skin, 30);
  lay(skin + 2, -100);
  lay(skin + kFatMm, 55);
  lay(ribs_mm(p), 420);
  const double cavity = skin + kFatMm + kMuscleMm;
  lay(cavity, -95);
  // Loops of bowel in the lower cavity: a smooth periodic pattern of wall and content.
  const double loops = std::sin(p.x() / 9.0) + std::sin(p.y() / 10.0 + 0.7 * std::sin(p.x() / 17.0)) +
                       std::sin(p.z() / 9.5 + std::sin(p.y() / 21.0));
  if (p.z() < -10 && p.y() < 35) lay(std::max(cavity + 6, 6 * (0.3 - loops)), 35);
  for (const Organ& organ : kOrgans) lay(ellipsoid_mm(p, organ.centre, organ.radii), organ.hu);
  lay(ellipsoid_mm(p, {54, 44, -46}, {9, 10, 24}), -60);
  lay(ellipsoid_mm(p, {-54, 48, -72}, {9, 10, 24}), -60);
  lay(std::hypot(p.x() - 14, p.y() - 30) - 10, 190);  // aorta
  lay(std::hypot(p.x() + 18, p.y() - 32) - 11, 160);  // inferior vena cava
  const double spine = spine_mm(p);
  lay(spine, 560);
  lay(spine + 3, std::abs(std::remainder(p.z() + 17, 34.0)) < 4 ? 90 : 230);
  lay(std::hypot(p.x(), p.y() - kSpineY - 24) - 8, 30);  // spinal canal
  lay(liver_mm(p), 105);
  return hu;
}

}  // namespace

double procedural_liver_mm(const Vector3d& p) {
  return liver_mm(p);
}

Body procedural_body(std::uint64_t seed) {
  return procedural_body(seed,
                         {.size = {243, 173, 144}, .origin_mm = {-181.5, -129, -140}, .spacing_mm = {1.5, 1.5, 2.0}});
}

Body procedural_body(std::uint64_t seed, const Grid& grid) {
  Body body;
  body.skin_mm = skin_mm;
  body.liver_mm = liver_mm;
  body.grid = grid;
  body.hu.resize(body.grid.voxels());
  tbb::parallel_for(0, body.grid.size[2], [&](int k) {
    for (int j = 0; j < body.grid.size[1]; ++j) {
      for (int i = 0; i < body.grid.size[0]; ++i) {
        const std::size_t at = body.grid.index(i, j, k);
        const double noisy = tissue_hu(body.grid.point(i, j, k)) + 9.0 * hashed_normal(seed, at);
        body.hu[at] = static_cast<std::int16_t>(std::lround(std::clamp(noisy, -1024.0, 3071.0)));
      }
    }
  });
  return body;
}

}  // namespace birdseye::hw_sim
