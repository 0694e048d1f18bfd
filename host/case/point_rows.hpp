#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/registration/geometry/matched_point.hpp"
#include "host/registration/geometry/seen_point.hpp"

namespace birdseye::host {

/// A place that is known at rest and now, with a name for messages and results.
struct NamedMatch {
  std::string name;
  std::size_t views = 0;  ///< that show it; 0: something else tells of it
  MatchedPoint place;
};

/// What a file tells of places of the organ, patient LPS mm.
struct PointRows {
  std::vector<SeenPoint> surface;
  std::vector<NamedMatch> matched;
};

/// Reads x_mm,y_mm,z_mm,sigma_mm, or these and rest_x_mm,rest_y_mm,rest_z_mm, which names them in its first line. A row
/// whose last three are empty is a place of the surface. sigma_mm: an axis. Refuses, naming file and line, anything
/// else, a sigma out of kLeastGivenSigma_mm to kMostGivenSigma_mm, no row at all and over 300, which would take
/// minutes.
Result<PointRows> read_point_rows(const std::filesystem::path& path);

}  // namespace birdseye::host
