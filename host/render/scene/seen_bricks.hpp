#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Which bricks of cells of a volume hold anything that a transfer function shows, by the interval of their HU.
class SeenBricks {
 public:
  static constexpr int kBrick = 4;  ///< cells of a brick along an axis
  SeenBricks(const Volume& volume, const TransferFunction& transfer);

  [[nodiscard]] const std::array<int, 3>& size() const { return size_; }
  /// One a brick, x fastest: 1 where something is seen.
  [[nodiscard]] const std::vector<std::uint8_t>& flags() const { return flags_; }
  /// Whether anything is seen in the bricks that a box of voxel coordinates touches, cut to the volume.
  [[nodiscard]] bool any(const Eigen::Array3f& low, const Eigen::Array3f& high) const;
  [[nodiscard]] std::size_t bytes() const { return flags_.capacity() + before_.capacity() * sizeof(int); }

 private:
  [[nodiscard]] int before(int i, int j, int k) const;

  std::array<int, 3> size_{};
  std::vector<std::uint8_t> flags_;
  std::vector<int> before_;  ///< how many are seen before each brick along all three axes
};

}  // namespace birdseye::host
