#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The frame that a file's points are asked for in.
enum class PointsOf {
  patient,  ///< DICOM LPS
  tracker,  ///< what a program of the tracker's poses shows; 3D Slicer shows RAS
  sensor    ///< of a body that is tracked: a file that states LPS or RAS is refused
};

/// Points of a file in the order of the file, mm.
struct NamedPoints {
  std::vector<Eigen::Vector3d> places_mm;
  std::vector<std::string> names;  ///< one for each point, each once; empty where the file does not name them so
  std::vector<std::string> notes;  ///< what was turned, scaled or passed over, a line each
};

/// Reads 3D Slicer's .mrk.json and .fcsv, MITK's .mps, and text tables: three numbers a line, a name before or behind
/// them; or with a first line that names the columns (name, x, y, z; also r, a, s and l, p, s; units as "x [cm]").
/// Fields are separated as TextRows has it; numbers with decimal commas may be separated by blanks too. What follows a
/// # is passed over. Points that a file states in RAS or LPS are turned into the frame that is asked for.
/// Refuses what is none of these, naming file, line and remedy.
Result<NamedPoints> read_named_points(const std::filesystem::path& path, PointsOf of);

/// The same without the names.
Result<std::vector<Eigen::Vector3d>> read_points(const std::filesystem::path& path, PointsOf of);

}  // namespace birdseye::host
