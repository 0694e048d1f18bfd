#pragma once

#include <optional>

#include "host/volume/marker_shape.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A marker's shape laid over the voxels.
struct MarkerFit {
  MarkerKind kind = MarkerKind::ball;
  Eigen::Vector3d centre_in_patient_mm;
  double sigma_mm = 0;                              ///< of the centre, per axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< of a ring or cylinder, unit length, patient frame
  double diameter_mm = 0;                           ///< outer, as found
  double scale = 1;                                 ///< what was found over what was asked for; not of a post
  double hu = 0;                                    ///< of the marker's material
  double contrast_hu = 0;                           ///< over what is round it; of a post, over its cavity
  /// Share of what differs from the surroundings that the shape explains, at most 1; not of a post.
  double explained = 0;
};

/// So many sigmas per axis off in space a centre is in 5 of 100 cases.
inline constexpr double kSigmasOf95 = 2.795;

/// Fits centre, axis, size, blur and density of one marker, from a centre that is right to a third of the marker. Each
/// voxel is taken for a mixture: the share that the shape fills has the marker's density, the rest has the density of
/// the surroundings beside it. Air on one side and skin on the other thus do not pull the centre.
/// directions: first guesses of the axis, columns. Empty where too few voxels surround the place, or the fit runs away.
std::optional<MarkerFit> fit_marker(const Volume& ct, const MarkerShape& shape,
                                    const Eigen::Vector3d& centre_in_patient_mm, const Eigen::Matrix3d& directions);

/// Whether what was fitted is of the size that was asked for, and brighter than what is round it.
bool has_size(const Volume& ct, const MarkerShape& shape, const MarkerFit& fit);

}  // namespace birdseye::host
