#pragma once

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// The camera after the volume was dragged by so many pixels about a point of it: what lies before the point follows
/// the mouse, half a turn for the picture's width. The point stays where it is in the picture.
Transform<Camera, Patient> orbited(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                   const Eigen::Vector3d& about_in_patient_mm, double right_px, double down_px);

/// The camera moved towards a point by a tenth of the way for each notch (away, where negative), no nearer than 10 mm
/// and no further than 10 m.
Transform<Camera, Patient> approached(const Transform<Camera, Patient>& camera_from_patient,
                                      const Eigen::Vector3d& point_in_patient_mm, double notches);

}  // namespace birdseye::host
