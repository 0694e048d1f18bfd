#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"

namespace birdseye::calibration {

/// The answers of all closed forms: R. Tsai and R. Lenz (1989), F. Park and B. Martin (1994), R. Horaud and F. Dornaika
/// (1995), N. Andreff et al. (1999), K. Daniilidis (1999), through OpenCV, and rotation by the turns' axes with
/// translation by least squares after it. Each form is tried, and is kept even if it failed, with the reason: for turns
/// of half a circle, for turns about one axis and for very small ones they return NaN or a matrix that is no rotation.
/// Lengths are scaled to order one first, as some forms mix them with rotations. Scores are not filled in yet.
std::vector<HandEyeStart> closed_forms(std::span<const SummedStation> stations);

/// The rotation camera <- sensor that best takes the axes of the sensor's turns between stations to those of the
/// camera's (Wahba's problem over all pairs, by W. Kabsch's singular value decomposition). Turns close to half a
/// circle, whose axis has no sign, are passed over.
Eigen::Matrix3d rotation_by_axes(std::span<const SummedStation> stations);

/// body_from_marker, given hand-eye: the mean rotation (chordal) and median translation over the stations.
Transform<TrackedBody, Marker> body_from_marker_of(std::span<const SummedStation> stations,
                                                   const Transform<Camera, Sensor>& camera_from_sensor);

/// Translations and the board's scale by linear least squares after the rotations. scale_free: otherwise it is 1.
ChainState translations_after(std::span<const SummedStation> stations, const Eigen::Matrix3d& camera_from_sensor,
                              bool scale_free);

}  // namespace birdseye::calibration
