#pragma once

#include <optional>
#include <span>

#include "calibration/base/image_view.hpp"
#include "calibration/geometry/round_field.hpp"

namespace birdseye::calibration {

/// The edge of the round field; empty where the picture shows none: a sensor that the field covers, a dark scene, an
/// edge of which too little is seen.
std::optional<RoundField> find_round_field(const GreyView& picture);

/// What most of a lens's pictures agree on, to 2 %; empty: they do not, or fewer than half of them show an edge.
/// of_pictures: how many were looked at.
std::optional<RoundField> agreed_round_field(std::span<const RoundField> found, std::size_t of_pictures);

/// How a picture's field compares with that of the lens's calibration.
enum class FieldSize {
  cannot_tell,  ///< too dark, or the sensor does not hold the edge
  same,         ///< within 5 %
  larger,       ///< it is bright where it was dark: the lens is zoomed in, or another
  smaller,      ///< it is dark where it was bright
};
FieldSize compare_round_field(const GreyView& picture, const RoundField& calibrated);

}  // namespace birdseye::calibration
