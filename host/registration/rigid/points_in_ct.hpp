#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The points, by index, that are nowhere at the patient: over 5 mm outside of the CT, or with nothing but air (under
/// -700 HU) within 20 mm. Points in patient LPS, mm.
std::vector<std::size_t> points_outside(const Volume& ct, std::span<const Eigen::Vector3d> points_mm);

/// Whether points that lie outside would all lie inside with the signs of x and y turned: points in RAS.
bool look_like_ras(const Volume& ct, std::span<const Eigen::Vector3d> points_mm);

/// Where the CT lies, in words.
std::string reach_of(const Volume& ct);

}  // namespace birdseye::host
