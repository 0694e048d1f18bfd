#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// Hounsfield units, or labels, as a compressed NIfTI file.
Result<void> write_volume(const std::filesystem::path& path, const Grid& grid, std::span<const std::int16_t> hu);
Result<void> write_labels(const std::filesystem::path& path, const Grid& grid, std::span<const std::uint8_t> labels);
struct LabelVolume {
  Grid grid;
  std::vector<std::uint8_t> labels;
};
/// What write_labels wrote.
Result<LabelVolume> read_labels(const std::filesystem::path& path);
/// A displacement field as ITK's programs read it: an image of vectors in patient LPS mm, compressed MetaImage.
Result<void> write_field(const std::filesystem::path& path, const Grid& grid,
                         std::span<const Eigen::Vector3f> displacement_mm);

}  // namespace birdseye::hw_sim
