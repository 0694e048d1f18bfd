#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern_view.hpp"

namespace birdseye::host {

/// Reads a folder of points that were detected before: three text files a view, which share the number at the end of
/// their names: *ids.N.txt (one number a line), *object_points.N.txt (x y z, mm) and *image_points.N.txt (x y, px).
/// Views in the order of their numbers, named after their image points' file. Numbers that are not finite are kept, for
/// the solver to name. Errors, naming file and line: a file is missing or holds something else, or counts differ.
/// prefix: reads only files whose names begin with it, as "left.".
Result<std::vector<calibration::PatternView>> read_point_views(const std::filesystem::path& folder,
                                                               const std::string& prefix = {});

}  // namespace birdseye::host
