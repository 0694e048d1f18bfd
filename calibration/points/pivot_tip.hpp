#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/points/pivot.hpp"

/// The linear part of a pivot, which its fit and its covariance share.
namespace birdseye::calibration::pivot {

using Poses = std::vector<PivotPose>;
using Indices = std::vector<std::size_t>;

inline constexpr int kSides = 8;

/// Mean pose of each divot, of those used.
struct Means {
  std::vector<Eigen::Matrix3d> rotation;
  std::vector<Eigen::Vector3d> translation;
  std::vector<double> count;
};

/// The tip's normal equations once each pivot is replaced by the mean of R t + q, and their solution of least length.
struct TipEquations {
  Means means;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  [[nodiscard]] Eigen::Vector3d pivot(std::size_t divot) const {
    return means.rotation[divot] * tip + means.translation[divot];
  }
};

TipEquations solve(const Poses& poses, const Indices& used, std::size_t divots);

/// Whether along some direction the poses say nothing of the tip.
bool leaves_open(const TipEquations& linear, std::size_t used);

/// From sensor to tip; poses that tell no tip may show any direction.
Eigen::Vector3d shaft_of(const Eigen::Vector3d& tip_mm);

/// To which of kSides sides each pose leans, from the mean of its divot.
std::vector<int> sides_of(const Poses& poses, const TipEquations& linear);

}  // namespace birdseye::calibration::pivot
