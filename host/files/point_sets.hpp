#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The frame of the patient that a file says its points are in.
enum class StatedFrame { none, lps, ras };
/// LPS, RAS, or the numbers 1 and 0 that 3D Slicer 4 wrote for them; none for any other word.
StatedFrame frame_of_word(std::string_view word);

struct StatedPoint {
  std::string name;  ///< may be empty
  Eigen::Vector3d place_mm;
};

/// Points as a file states them.
struct StatedPoints {
  std::vector<StatedPoint> points;
  StatedFrame frame = StatedFrame::none;
  std::vector<std::string> notes;  ///< what was scaled or passed over, a line each
};

/// Reads a list of points as 3D Slicer 5 saves it (.mrk.json). Points that have no place yet are passed over, with a
/// note. Refuses several lists, another unit than mm and another frame than LPS or RAS.
Result<StatedPoints> read_slicer_markups(const std::filesystem::path& path);

/// Reads a point set as MITK saves it (.mps); MITK's frame is LPS. Refuses several time steps, and points with a
/// geometry of their own.
Result<StatedPoints> read_mitk_points(const std::filesystem::path& path);

}  // namespace birdseye::host
