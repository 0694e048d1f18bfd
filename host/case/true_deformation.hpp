#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/bezier_patch.hpp"
#include "host/deform/displacement_field.hpp"

namespace birdseye::host {

/// A point of the organ, patient frame, mm: where it was when the CT was taken, and where it is in the views.
struct Landmark {
  std::string name;
  Eigen::Vector3d rest_mm, deformed_mm;
};

/// The simulator's truth/landmarks.csv. Errc::bad_format, naming file and line, for what is none.
Result<std::vector<Landmark>> read_landmarks(const std::filesystem::path& path);

/// The deformation that a simulated case was made by, exact: docs/manual/simulator.md.
struct TrueDeformation {
  Eigen::Vector3d low_mm, box_mm;  ///< of its box, whose axes are the patient's
  BezierPatch patch;               ///< over the box as unit cube
};

/// The simulator's truth/control_points.json. Errc::bad_format, naming the file, for what is none.
Result<TrueDeformation> read_true_deformation(const std::filesystem::path& path);

/// The paper's Equation 7: the sum of squared distances, the box being the unit cube, between the true displacements of
/// a level 3 octree's free vertices and those by field (null: zero).
double epsilon(const TrueDeformation& truth, const DisplacementField* field);

}  // namespace birdseye::host
