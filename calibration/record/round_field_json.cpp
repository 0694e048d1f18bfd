#include "calibration/record/round_field_json.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace birdseye::calibration {

nlohmann::json json_of_round_field(const RoundField& field) {
  return {{"centre_px", {field.centre_px.x(), field.centre_px.y()}}, {"radius_px", field.radius_px}};
}

RoundField round_field_of_json(const nlohmann::json& json) {
  const auto& centre = json.at("centre_px");
  const RoundField out{{centre.at(0).get<double>(), centre.at(1).get<double>()}, json.at("radius_px").get<double>()};
  if (!out.centre_px.allFinite() || !(out.radius_px > 0 && out.radius_px < 1e6))
    throw std::range_error("a round field that cannot be");
  return out;
}

}  // namespace birdseye::calibration
