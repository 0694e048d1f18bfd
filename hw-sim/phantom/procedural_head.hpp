#pragma once

#include <cstdint>
#include <vector>

#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/implants.hpp"

namespace birdseye::hw_sim {

/// The labels of the head's segmentation.
enum HeadLabel : std::uint8_t { kHead = 1, kArtery = 2, kBrainTumour = 3 };

/// A plastic head: a smooth skin with brow, eyes, nose, lips, chin and ears over a skull, jaw and neck; in the brain,
/// arteries and a tumour that have taken up contrast medium. Its face looks along -y (LPS).
struct Head {
  std::vector<std::int16_t> hu;
  std::vector<std::uint8_t> labels;
  VesselTree arteries;
  Eigen::Vector3d tumour_centre_mm;
};

/// Signed distance to the head's skin.
double procedural_head_mm(const Eigen::Vector3d& point_in_patient_mm);
/// The head, scanned on this grid.
Head procedural_head(std::uint64_t seed, const Grid& grid);

}  // namespace birdseye::hw_sim
