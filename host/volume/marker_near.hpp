#pragma once

#include <optional>

#include "calibration/base/result.hpp"
#include "host/volume/marker_fit.hpp"

namespace birdseye::host {

/// How far a marker's centre may lie from the place that a person pointed at: half a marker, and a careless hand.
inline constexpr double kPickReach_mm = 10;

/// The marker nearest to a place that a person pointed at, patient LPS mm: a post of any size, a ball of 4 to 16 mm, a
/// ring or cylinder 15 mm across with a hole of 5 mm. shape: this kind and size alone. It may hang together with bone
/// or another marker, which a search of the whole CT passes over.
/// Errc::not_found, with what is there, where no marker's centre lies within kPickReach_mm; Errc::bad_value for a place
/// outside of the CT.
Result<MarkerFit> find_marker_near(const Volume& ct, const Eigen::Vector3d& place_in_patient_mm,
                                   const std::optional<MarkerShape>& shape = std::nullopt);

}  // namespace birdseye::host
