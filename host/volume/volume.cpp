#include "host/volume/volume.hpp"

namespace birdseye::host {

std::string orientation_letters(const Eigen::Affine3d& patient_from_voxel) {
  static constexpr char kPositive[] = {'L', 'P', 'S'};
  static constexpr char kNegative[] = {'R', 'A', 'I'};
  std::string letters;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = patient_from_voxel.linear().col(axis);
    Eigen::Index most = 0;
    direction.cwiseAbs().maxCoeff(&most);
    letters += direction[most] > 0 ? kPositive[most] : kNegative[most];
  }
  return letters;
}

}  // namespace birdseye::host
