#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/implants.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// An organ at rest, as far as its deformations depend on it.
struct OrganShape {
  Grid grid;  ///< a box with a margin about the organ
  std::vector<std::uint8_t> labels;
  std::vector<int> organ_labels;  ///< which of the labels are the organ and what lies in it
  Mesh surface;                   ///< patient LPS, mm
  Eigen::Vector3d towards_scope;  ///< from the organ, unit
};

/// The organ of a registration case, at rest, in a CT cut to a margin about it.
struct Subject : OrganShape {
  std::vector<std::int16_t> hu;
  std::string transfer;  ///< the preset of `birdseye render` that shows it
  Coat coat = Coat::liver;
  VesselTree vessels;
  Eigen::Vector3d tumour_centre_mm;
  double view_distance_mm = 0;  ///< from its surface to a lens that has it well in the picture
};

/// The liver of the procedural body.
Result<Subject> liver_subject(std::uint64_t seed);
/// The liver of a CT of the user's own, as body_from_ct reads it.
Result<Subject> liver_subject(const std::filesystem::path& ct, const std::filesystem::path& labels, int liver_label,
                              std::uint64_t seed);
/// The liver of a patient that write_phantom wrote to this folder.
Result<OrganShape> liver_shape(const std::filesystem::path& phantom);
Subject head_subject(std::uint64_t seed);

}  // namespace birdseye::hw_sim
