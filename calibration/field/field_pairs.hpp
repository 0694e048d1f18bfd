#pragma once

#include <optional>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/field/field_fit.hpp"
#include "calibration/geometry/field_map.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// Two sensors on one rigid body at the same moment.
struct FieldPair {
  std::string name;
  Transform<Tracker, Sensor> a, b;
};

struct FieldPairSettings {
  std::optional<FieldBasis> basis;
  std::optional<double> distance_mm;  ///< between the sensors, where it is known
};

/// The map that makes the body rigid: with p and R corrected, R_a^T (p_b - p_a) and R_a^T R_b are the same in all
/// pairs. That leaves open a rigid motion of everything, so the map is asked to have none over the samples. It leaves
/// the scale open too, unless the distance is known. Solved by Gauss-Newton over both maps and the sensors' distance;
/// an orientation counts as much as 200 mm/rad would make of it. Held-out errors are those of p_b - p_a. At most 1500
/// pairs are used, evenly taken. Refuses fewer than 100 pairs, sensors that are not fixed to each other or closer than
/// 30 mm, and volumes thinner than 100 mm.
Result<FieldFit> fit_field_from_pairs(std::span<const FieldPair> pairs, const FieldPairSettings& settings = {});

}  // namespace birdseye::calibration
