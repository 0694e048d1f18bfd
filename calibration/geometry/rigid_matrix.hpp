#pragma once

#include <Eigen/Core>

namespace birdseye {

/// Nothing in an operating room is that far from anything else. Far beyond it single precision ends, in which pictures
/// are drawn.
inline constexpr double kFarthestMm = 1e5;

/// Whether the upper rows are rotation and translation, mm: finite, orthonormal within the tolerance, right-handed, and
/// of a place within kFarthestMm.
bool is_rigid(const Eigen::Matrix4d& matrix, double tolerance);

}  // namespace birdseye
