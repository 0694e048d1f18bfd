#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/geometry/field_map.hpp"

/// A map of the field as JSON, exactly: what is read back is the same map to the bit.
namespace birdseye::calibration {

void to_json(nlohmann::json& json, const FieldMapData& data);
/// Throws what nlohmann throws, or std::invalid_argument. Whether the data make a map is for FieldMap::from to say.
void from_json(const nlohmann::json& json, FieldMapData& data);

}  // namespace birdseye::calibration
