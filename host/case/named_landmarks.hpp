#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/case/point_rows.hpp"
#include "host/registration/views/synthetic_view.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Whether a place, patient frame, is among the CT's voxel centres.
bool lies_in(const Volume& ct, const Eigen::Vector3d& place_mm);

/// A landmark as a case has it.
struct LandmarkEntry {
  struct Seen {
    std::string view;
    Eigen::Vector2d pixel_px;
    double sigma_px = 1;
  };
  std::string name;
  Eigen::Vector3d place_mm;  ///< as the CT has it, patient frame
  double sigma_mm = 1;       ///< of that, an axis
  std::vector<Seen> seen;
};

/// By the rays of the views that show it. Refuses, naming the case's key first, the name of one of the others, a place
/// outside the CT, a view that is not there or is named twice, and what matched_by_rays() refuses.
Result<NamedMatch> match_of(const LandmarkEntry& entry, const Volume& ct, const std::vector<VideoView>& views,
                            const std::vector<NamedMatch>& others);

}  // namespace birdseye::host
