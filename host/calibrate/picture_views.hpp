#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/detect/pattern.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "calibration/geometry/round_field.hpp"

namespace birdseye::host {

struct PictureViews {
  std::vector<calibration::PatternView> used;  ///< in the order of their names, numbers in them by value
  struct Rejected {
    std::string name, reason;
  };
  std::vector<Rejected> rejected;
  int width_px = 0, height_px = 0;
  std::string note;  ///< that the pattern was read otherwise than it was told; empty where it was not
  std::vector<std::filesystem::path> files;  ///< of all pictures, for reports; empty where points were found before
  std::optional<RoundField> round_field;     ///< that the pictures agree on; empty: they show no edge
};

/// The picture of a view, made small enough for a page, as data_url() gives it; empty where no file or more than one
/// has the view's name, or it cannot be read any more.
std::string picture_of_view(const std::vector<std::filesystem::path>& files, const std::string& view);

/// Finds the pattern in each picture (PNG, JPEG, BMP, TIFF, PPM, PGM), on all cores. A folder stands for all pictures
/// in it, and a path whose last part holds * or ? for all that match. A picture that cannot be read is rejected by
/// name; pictures of two sizes are an error that names both. Which of its two layouts a ChArUco board has, all pictures
/// together decide, whatever the pattern says. pixel_aspect: width of a pixel over its height; the
/// pattern is sought in the picture as square pixels would show it, and its points are those of the picture as it is.
Result<PictureViews> read_picture_views(const calibration::Pattern& pattern,
                                        const std::vector<std::filesystem::path>& images_or_folders,
                                        double pixel_aspect = 1);

/// Views whose points were found before, of a folder that read_point_views reads. size: of the pictures, as
/// "1920x1080"; empty: that of a picture which lies beside the points.
Result<PictureViews> read_found_views(const std::filesystem::path& folder, const std::string& size);

/// "0.5" or "1:2": width of a pixel over its height, 1/8 to 8.
Result<double> parse_pixel_aspect(const std::string& text);

}  // namespace birdseye::host
