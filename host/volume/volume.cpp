#include "host/volume/volume.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr std::string_view kPositive = "LPS", kNegative = "RAI";

}  // namespace

std::string orientation_letters(const Eigen::Affine3d& patient_from_voxel) {
  std::string letters;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = patient_from_voxel.linear().col(axis);
    Eigen::Index most = 0;
    direction.cwiseAbs().maxCoeff(&most);
    letters +=
        direction[most] > 0 ? kPositive[static_cast<std::size_t>(most)] : kNegative[static_cast<std::size_t>(most)];
  }
  return letters;
}

std::optional<Eigen::Matrix3d> axes_of_letters(std::string_view letters) {
  if (letters.size() != 3) return std::nullopt;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto positive = kPositive.find(letters[axis]), negative = kNegative.find(letters[axis]);
    const auto row = std::min(positive, negative);
    if (row == std::string_view::npos) return std::nullopt;
    axes(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(axis)) = positive < negative ? 1 : -1;
  }
  // Each of the patient's directions once.
  if (std::abs(axes.determinant()) < 0.5) return std::nullopt;
  return axes;
}

}  // namespace birdseye::host
