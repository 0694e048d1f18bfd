#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/case/subject.hpp"
#include "hw-sim/case/tissue_map.hpp"

namespace birdseye::hw_sim {

/// A point of the tissue, patient LPS mm.
struct TrueLandmark {
  std::string name;
  Eigen::Vector3d rest_mm, deformed_mm;
};

/// Points whose true place is known: surface_01.. on the deformed organ where a view sees it, vessel_01.. where vessels
/// fork or halfway between forks, tumour, its centre, and hidden_01.., as many as surface_, where no view sees the
/// organ or only at a slant. All are spread out as far as possible. Refused where the views see too little of the
/// organ. scope: a laparoscope with the deformed organ in its cavity.
Result<std::vector<TrueLandmark>> choose_landmarks(const Subject& subject, const Mesh& deformed, const TissueMap& map,
                                                   const Laparoscope& scope,
                                                   std::span<const Transform<Camera, Patient>> views,
                                                   std::uint64_t seed);

/// Places of the deformed organ's surface that no view sees, or only at a slant, as a pointer's tip there would be
/// measured, patient LPS mm: spread out, off by noise_mm an axis, and none of them a landmark but by chance. Refused
/// where the views leave too little of the organ unseen.
Result<std::vector<Eigen::Vector3d>> choose_touches(const Subject& subject, const Mesh& deformed, const TissueMap& map,
                                                    const Laparoscope& scope,
                                                    std::span<const Transform<Camera, Patient>> views, int count,
                                                    double noise_mm, std::uint64_t seed);

}  // namespace birdseye::hw_sim
