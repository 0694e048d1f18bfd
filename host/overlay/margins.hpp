#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/scene/scene.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A shell about a target, as the margin of a resection: what lies so many mm from its surface.
struct MarginShell {
  double mm = 0;
  /// Close together on the shell that lies kMarginDisc_mm nearer to the target; patient frame.
  std::vector<Eigen::Vector3d> places_mm;
};
/// What is drawn about each of a shell's places reaches so far, and so to the shell.
inline constexpr double kMarginDisc_mm = 0.9;

/// The narrowest first.
using Margins = std::vector<MarginShell>;
inline constexpr double kLeastMargin_mm = 1, kMostMargin_mm = 40;
inline constexpr std::size_t kMostMargins = 4;

/// The colour of a shell, by its place in Margins: four that people who see few colours tell apart from each other,
/// from the liver and from vessels, and the first from the tumour and its outline too
/// (tests/host/window/theme_test.cpp); in [0, 1], as the screen shows it.
Eigen::Vector3d margin_colour(std::size_t shell);

/// Where labels hold one of values is the target. Errc::bad_value for shells that are not to be had, naming them;
/// Errc::not_found where no voxel has one of values.
Result<Margins> margins_about(const Volume& labels, std::span<const int> values, std::vector<double> mm);

/// As tissue takes the shells with it.
Margins deformed(const Margins& margins, const DisplacementField& field);

/// Lays each shell's silhouette over a picture: a faint fill, and a line within its outline.
void draw_margins(const Margins& margins, const CameraModel& camera,
                  const Transform<Camera, Patient>& camera_from_patient, ImageRgba& picture);

}  // namespace birdseye::host
