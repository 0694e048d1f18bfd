#pragma once

#include <optional>

#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What stands round an air cavity, as rays from the cavity's centre see it.
struct HollowPost {
  Eigen::Vector3d centre_in_patient_mm;  ///< the cavity's centroid; up to its rim where it is open
  double sigma_mm = 0;                   ///< of the centre, per axis
  double cavity_mm = 0;                  ///< diameter of a ball of the cavity's volume
  double outer_mm = 0;     ///< from outside to outside where the post is slim; 0: no ray leaves on both sides
  double wall_hu = 0;      ///< what the wall's densest part has
  double contrast_hu = 0;  ///< over the cavity
  double open = 0;         ///< share of the directions in which there is no wall
  double free = 0;         ///< share in which a wall is followed by open air
  double uneven = 0;       ///< rms by which opposite edges differ, over the cavity's radius
  bool endless = false;    ///< it goes on through an opening: a tube, a gap
  bool cut = false;        ///< the border of the CT is in the way
};

/// Measures the cavity round a place inside of it. widest_mm: the post's outer diameter, beyond which no wall is looked
/// for. Empty where the place is in no air, in no cavity of such a size, or in one that has open air on hardly any
/// side.
///
/// The centre is the centroid of the missing density, summed along rays out to the ridge of the wall. There the blur
/// has carried as much of the outer air inwards as of the cavity outwards, so that a thin wall does not pull it.
std::optional<HollowPost> fit_hollow_post(const Volume& ct, const Eigen::Vector3d& place_in_patient_mm,
                                          double widest_mm);

}  // namespace birdseye::host
