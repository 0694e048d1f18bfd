#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// A CT of a patient with a liver, before vessels, tumour and markers are put in.
struct Body {
  Grid grid;
  std::vector<std::int16_t> hu;
  Field skin_mm;   ///< signed distance to the skin
  Field liver_mm;  ///< signed distance to the liver's surface
};

/// A procedural torso: wall of fat and muscle, ribs, spine, kidneys, spleen, great vessels and a liver of two lobes.
Body procedural_body(std::uint64_t seed);
/// The same, scanned on this grid.
Body procedural_body(std::uint64_t seed, const Grid& grid);
/// Signed distance to the surface of the procedural body's liver.
double procedural_liver_mm(const Eigen::Vector3d& point_in_patient_mm);

/// A CT of the user's own (a folder of one DICOM series, NIfTI, NRRD or MHA), resampled to axes along the patient and
/// at most 2 mm. The liver is taken from labels where given (label value), else found as the largest thick region of
/// soft tissue on the right.
Result<Body> body_from_ct(const std::filesystem::path& ct, const std::filesystem::path& labels, int liver_label);

}  // namespace birdseye::hw_sim
