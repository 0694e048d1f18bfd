#pragma once

#include <vector>

#include "host/volume/volume.hpp"

namespace birdseye::host {

struct MarkerShape {
  double diameter_mm = 8;
  std::int16_t threshold_hu = 1200;  ///< half the height of the ball over what is round it, roughly
};

/// The centres of bright balls of this size in a CT, patient LPS mm, brightest first. A component over the threshold
/// counts where its volume and its extent along every axis fit the ball; its centre is weighted by HU over what is
/// round it, to a small part of a voxel.
std::vector<Eigen::Vector3d> find_markers(const Volume& ct, const MarkerShape& shape = {});

}  // namespace birdseye::host
