#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calibration/field/field_fit.hpp"

/// What the measured places say of the board as it was written down: no field of metal looks like these mistakes.
namespace birdseye::calibration::detail {

/// Lengths by the tracker over those of the board along each of the board's axes: the affine fit of all that is used.
Eigen::Vector3d stretch_of(std::span<const FieldSample> samples, const std::vector<bool>& used);

/// The level, of at least four along an axis, that lies off the others as a whole. The places' errors are fitted by
/// polynomials of the second order (of the first where there are four levels), alone and with one level shifted; a
/// level counts as shifted where that takes away most of what is left, for metal moves no level as a whole.
std::optional<ShiftedLevel> shifted_level(std::span<const FieldSample> samples, const std::vector<bool>& used,
                                          const Transform<Tracker, Marker>& tracker_from_board);

}  // namespace birdseye::calibration::detail
