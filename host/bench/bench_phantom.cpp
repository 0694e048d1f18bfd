#include "host/bench/bench_phantom.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "calibration/base/units.hpp"
#include "host/deform/bezier_patch.hpp"
#include "host/deform/patch_octree.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

const Vector3d kBox_mm(256, 256, 160);

struct Vessel {
  Vector3d from_mm, to_mm;
  double radius_mm;
};

const Vessel kVessels[] = {
    {{120, 128, 20}, {125, 130, 70}, 8},  {{125, 130, 70}, {90, 110, 105}, 6}, {{125, 130, 70}, {165, 125, 110}, 6},
    {{90, 110, 105}, {65, 95, 120}, 4},   {{90, 110, 105}, {80, 140, 130}, 4}, {{165, 125, 110}, {185, 150, 125}, 4},
    {{165, 125, 110}, {180, 95, 120}, 4}, {{125, 130, 70}, {120, 175, 90}, 5}, {{125, 130, 70}, {140, 85, 80}, 5},
};

/// Below 1 inside.
double ellipsoid(const Vector3d& p, const Vector3d& centre, const Vector3d& radii) {
  return (p - centre).cwiseQuotient(radii).norm();
}

bool inside(const Vessel& vessel, const Vector3d& p) {
  const Vector3d along = vessel.to_mm - vessel.from_mm;
  const double t = std::clamp((p - vessel.from_mm).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - vessel.from_mm - t * along).norm() < vessel.radius_mm;
}

double body_hu(const Vector3d& p) {
  const double e = std::hypot((p.x() - 128) / 120, (p.y() - 128) / 92);
  double hu = e >= 1 ? -1000 : e > 0.93 ? -90 : 35;
  if (std::abs(e - 0.86) < 0.03 && std::fmod(p.z() + 0.25 * p.y(), 22.0) < 9) hu = 600;  // ribs
  if (std::hypot(p.x() - 128, p.y() - 195) < 15) hu = 500;                               // spine
  return hu;
}

double hu_at(const Vector3d& p, bool torso) {
  const bool liver = ellipsoid(p, {110, 128, 85}, {72, 60, 55}) < 1 || ellipsoid(p, {175, 122, 105}, {48, 40, 32}) < 1;
  if (!liver) return torso ? body_hu(p) : -1000;
  if (ellipsoid(p, {85, 150, 70}, {9, 9, 9}) < 1) return 45;
  return std::any_of(std::begin(kVessels), std::end(kVessels), [&p](const Vessel& vessel) { return inside(vessel, p); })
             ? 210
             : 100;
}

}  // namespace

Volume bench_phantom(const std::string& kind, const std::array<int, 3>& size) {
  Volume v;
  v.size = size;
  v.spacing_mm = kBox_mm.cwiseQuotient(Vector3d(size[0], size[1], size[2]));
  v.patient_from_voxel.linear() = v.spacing_mm.asDiagonal();
  v.patient_from_voxel.translation() = 0.5 * v.spacing_mm;
  v.hu.reserve(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
               static_cast<std::size_t>(size[2]));
  std::mt19937 rng(1);
  std::normal_distribution<double> noise(0, 10);
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        const double hu = hu_at(v.patient_from_voxel * Vector3d(i, j, k), kind == "torso") + noise(rng);
        v.hu.push_back(static_cast<std::int16_t>(std::lround(std::max(-1024.0, hu))));
      }
    }
  }
  return v;
}

TransferFunction bench_transfer() {
  return TransferFunction({{-1024, {0, 0, 0}, 0},
                           {20, {0.5, 0.2, 0.1}, 0},
                           {60, {0.6, 0.25, 0.15}, 0.02},
                           {150, {0.75, 0.35, 0.25}, 0.04},
                           {180, {0.9, 0.1, 0.1}, 0.43},
                           {300, {0.95, 0.3, 0.2}, 0.7},
                           {600, {1, 1, 0.95}, 2.3}});
}

CameraModel bench_camera(int width_px, int height_px) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 0.5 * height_px / std::tan(15 * kRadPerDeg);
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  return camera;
}

Transform<Camera, Patient> bench_pose(double azimuth_deg) {
  const double azimuth = azimuth_deg * kRadPerDeg;
  const double elevation = 30 * kRadPerDeg;
  const Vector3d away(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                      std::sin(elevation));
  const Vector3d forward = -away;
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d patient_from_camera;
  patient_from_camera << right, forward.cross(right), forward;
  return Transform<Patient, Camera>(patient_from_camera, Vector3d(0.5 * kBox_mm + 340 * away)).inverse();
}

std::pair<DisplacementField, std::size_t> bench_deformation(const Volume& volume, int level) {
  PatchOctree tree = *PatchOctree::uniform(level);
  BezierPatch patch = *BezierPatch::create({4, 4, 4});
  std::vector<Vector3d> moves;
  for (std::size_t i = 0; i < patch.free_points(); ++i) {
    // All the same way, and on one side further: the middle is pushed and turned against the faces, which hold still.
    const double side = i % 3 == 0 ? 1.6 : i % 3 == 1 ? 1 : 0.2;
    moves.emplace_back(0.05 * side, 0.08 * side, -0.20 * side);
  }
  patch.set_displacements(moves);
  patch.drive(tree);
  const Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  return {field_of(tree, volume.patient_from_voxel * Eigen::Scaling(last)), tree.free_vertices()};
}

}  // namespace birdseye::host
