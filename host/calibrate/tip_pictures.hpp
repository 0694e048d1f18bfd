#pragma once

#include <string>
#include <vector>

#include "calibration/points/pivot.hpp"

namespace birdseye::host {

// Pictures of a tip's calibration, as SVG.

/// A bar for each pose, in the order given, with outliers marked and lines between divots. Bars of outliers that would
/// make all others too small to read are cut, and said to be.
std::string tip_residuals_svg(const std::vector<calibration::PivotPose>& poses, const calibration::Pivot& pivot);

/// Where the tip was at each pose, about its pivot, from three sides.
std::string tip_cloud_svg(const calibration::Pivot& pivot);

/// Where the sensor was at each pose, about its divot, from three sides, with the sphere on which a tip that stood
/// still keeps it.
std::string tip_places_svg(const std::vector<calibration::PivotPose>& poses, const calibration::Pivot& pivot);

/// To which side and how far the pointer leaned at each pose, seen along its mean direction in each divot; sides to
/// which it did not lean are shaded.
std::string tilt_coverage_svg(const std::vector<calibration::PivotPose>& poses, const calibration::Pivot& pivot);

}  // namespace birdseye::host
