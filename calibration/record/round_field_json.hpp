#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/geometry/round_field.hpp"

namespace birdseye::calibration {

/// A round field as records and operations hold it.
nlohmann::json json_of_round_field(const RoundField& field);
/// Throws what nlohmann's parser throws, and std::range_error of a radius or a centre that cannot be.
RoundField round_field_of_json(const nlohmann::json& json);

}  // namespace birdseye::calibration
