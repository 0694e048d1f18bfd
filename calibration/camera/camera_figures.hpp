#pragma once

#include "calibration/camera/camera_views.hpp"

namespace birdseye::calibration {

/// Appends a used view, its pose and its points.
void add_view(const SoundView& view, const CameraModel& camera, const BundleView& fitted, double held_out_squares_px2,
              CameraCalibration& out);
/// Tilts' spread and distances, from the views.
void add_geometry(CameraCalibration& out);
/// Regions and coverage, from the points.
void add_regions(int columns, int rows, CameraCalibration& out);

}  // namespace birdseye::calibration
