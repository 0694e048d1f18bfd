#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern.hpp"
#include "calibration/detect/pattern_view.hpp"

namespace birdseye::host {

struct PictureViews {
  std::vector<calibration::PatternView> used;  ///< in the order of their names, numbers in them by value
  struct Rejected {
    std::string name, reason;
  };
  std::vector<Rejected> rejected;
  int width_px = 0, height_px = 0;
  std::string note;  ///< that the pattern was read otherwise than it was told; empty where it was not
};

/// Finds the pattern in each picture (PNG, JPEG, BMP, TIFF), on all cores. A folder stands for all pictures in it. A
/// picture that cannot be read is rejected by name; pictures of two sizes are an error that names both. Which of its
/// two layouts a ChArUco board has, all pictures together decide, whatever the pattern says.
Result<PictureViews> read_picture_views(const calibration::Pattern& pattern,
                                        const std::vector<std::filesystem::path>& images_or_folders);

}  // namespace birdseye::host
