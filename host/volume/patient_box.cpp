#include "host/volume/patient_box.hpp"

#include <limits>

namespace birdseye::host {

PatientBox patient_box(const Volume& volume) {
  PatientBox box;
  box.low_mm.setConstant(std::numeric_limits<double>::max());
  box.high_mm = -box.low_mm;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d voxel((corner & 1) * (volume.size[0] - 1), (corner >> 1 & 1) * (volume.size[1] - 1),
                                (corner >> 2) * (volume.size[2] - 1));
    const Eigen::Vector3d place_mm = volume.patient_from_voxel * voxel;
    box.low_mm = box.low_mm.cwiseMin(place_mm);
    box.high_mm = box.high_mm.cwiseMax(place_mm);
  }
  return box;
}

}  // namespace birdseye::host
