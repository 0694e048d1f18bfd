#pragma once

#include <Eigen/Core>
#include <span>

#include "calibration/base/result.hpp"
#include "calibration/geometry/field_map.hpp"

/// Whether measured places say enough for a map between them: a board at two heights says nothing about how the field
/// bends from one to the other.
namespace birdseye::calibration::detail {

/// The box around places along their own axes, those of their scatter: a board that is tilted in the tracker's frame is
/// as thin in it as it is.
struct OwnBox {
  Eigen::Matrix3d axes;  ///< a column each
  Eigen::Vector3d low_mm, high_mm;

  [[nodiscard]] bool holds(const Eigen::Vector3d& place_mm) const;
};
OwnBox own_box(std::span<const Eigen::Vector3d> places_mm);

/// Refuses places at two levels, along whichever direction. The parabola that is zero at both is zero at all places and
/// anything between them, so that a fit leaves free how the field bends there.
Result<void> check_levels(std::span<const Eigen::Vector3d> places_mm, FieldFunctions box);

}  // namespace birdseye::calibration::detail
