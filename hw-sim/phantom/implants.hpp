#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "hw-sim/phantom/body.hpp"

namespace birdseye::hw_sim {

/// The labels of segmentation.nii.gz.
enum Label : std::uint8_t { kBackground = 0, kLiver = 1, kPortal = 2, kHepatic = 3, kTumour = 4 };

struct Rod {
  Rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_from_mm, double radius_to_mm);

  Eigen::Vector3d a, b;
  double radius_a_mm, radius_b_mm;
  Eigen::Vector3d middle;
  double reach_mm;  ///< no part of it is farther from the middle
};
using VesselTree = std::vector<Rod>;

/// Less than at_most_mm, or that: what is farther is not looked at.
double distance_mm(const VesselTree& tree, const Eigen::Vector3d& point, double at_most_mm);

/// What is put into a body: everything that the demo looks for and whose truth is known.
struct Implants {
  Eigen::Vector3d liver_centre_mm;
  Eigen::Vector3d tumour_centre_mm;
  Eigen::Vector3d tumour_radii_mm;
  VesselTree portal, hepatic;
  std::vector<Eigen::Vector3d> markers_mm;  ///< centres of balls that stand on the skin
};

inline constexpr double kMarkerRadiusMm = 4;
/// The direction from the liver towards the laparoscope, which comes in by the navel: forward and towards the feet
/// (LPS, unit length).
Eigen::Vector3d towards_scope();

/// Chooses places: a tumour some 27 mm under the face of the liver that the scope sees, two vessel trees grown from
/// hilum and vena cava, six markers over the front of the body. Refused where the liver is too small to hold them.
Result<Implants> choose_implants(const Body& body, std::uint64_t seed);

/// Burns the implants into body.hu and returns the label of each voxel.
std::vector<std::uint8_t> implant(Body& body, const Implants& implants, std::uint64_t seed);

}  // namespace birdseye::hw_sim
