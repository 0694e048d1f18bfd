#pragma once

#include <string>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Two phantoms of 256 x 256 x 160 mm for benchmarks, with 10 HU of noise: "liver", an organ of two ellipsoids with
/// vessels and a lesion in air, and "torso", the same in a body with spine and ribs.
Volume bench_phantom(const std::string& kind, const std::array<int, 3>& size);
/// Tissue like mist, vessels and bone nearly opaque.
TransferFunction bench_transfer();

/// A pinhole with 30 degrees between top and bottom, 340 mm from the phantom's middle, 30 degrees above it.
CameraModel bench_camera(int width_px, int height_px);
Transform<Camera, Patient> bench_pose(double azimuth_deg);

/// Bends the phantom by up to some 20 mm, smoothly, by an octree of patches of one level that a Bezier patch drives;
/// gives the number of free vertices.
std::pair<DisplacementField, std::size_t> bench_deformation(const Volume& volume, int level);

}  // namespace birdseye::host
