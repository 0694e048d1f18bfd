#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Voxels of a mask that hang together, corners included. In voxels.
struct Component {
  Eigen::Array3i low{1 << 30, 1 << 30, 1 << 30}, high{-1, -1, -1};
  std::size_t voxels = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  [[nodiscard]] Eigen::Vector3d centre_voxel() const { return sum / static_cast<double>(voxels); }
};

/// The connected parts of a mask on the CT's grid. fill: writes 1 or 0 for each voxel of the CT, x fastest.
std::vector<Component> components_of(const Volume& ct, const std::function<void(unsigned char* mask)>& fill);

}  // namespace birdseye::host
